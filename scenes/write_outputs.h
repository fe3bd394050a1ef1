#pragma once
/// @file scenes/write_outputs.h
/// Render → files. All of them are complete, or none has changed.

#include <filesystem>
#include <optional>
#include <vector>

#include "base/output_file.h"
#include "scenes/load_scene.h"
#include "scenes/render.h"

namespace tensorray {

/// The files of an OutputDescription, being written; those that it does not name are absent.
struct OutputFiles {
  std::optional<OutputFile> image, exr, spectral, photons, paths, tubes, fluence;
};

/// Opens the files, so that one that cannot be written is known before the work is done.
/// @throw std::runtime_error naming the file and the mend.
OutputFiles open_outputs(const OutputDescription& output);

/// Writes the files; when all are complete they take their names. @return the names.
/// @throw std::runtime_error naming the file and the reason; no file has changed then, unless one could be written but
/// not take its name, which leaves those that were renamed before it.
std::vector<std::filesystem::path> write_outputs(const Render& render, const Scene& scene, OutputFiles files);

/// The exposure, in stops, at which a scene-linear picture is well shown: its brightest hundredth just below white.
double automatic_exposure(const Image& linear);

}  // namespace tensorray
