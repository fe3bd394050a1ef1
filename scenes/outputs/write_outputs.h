#pragma once
/// @file scenes/outputs/write_outputs.h
/// Render → files. All of them are complete, or none has changed (commit_all).

#include <map>
#include <string>

#include "base/output_file.h"
#include "scenes/description/description.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// Files being written, by the key of the output.
using OutputFiles = std::map<std::string, OutputFile>;

/// Opens the files of the scene's outputs, so that one that cannot be written is known before the work is done; so is
/// a .vtp file that lacks its program (vtk_files.h).
/// @throw std::runtime_error naming the file and the fix.
OutputFiles open_outputs(const OutputDescription& output);

/// Writes the files under their temporary names: commit_all then gives them their own.
/// @throw std::runtime_error naming the file and the reason.
void write_outputs(const Render& render, const Scene& scene, OutputFiles& files);

}  // namespace tensorray
