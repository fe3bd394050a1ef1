#pragma once
/// Render → files. Either all files are complete, or none has changed (commit_all).

#include <map>
#include <string>

#include "base/files/output_file.h"
#include "scenes/description/description.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// Files that are being written, by the key of their output.
using OutputFiles = std::map<std::string, OutputFile>;

/// Opens the files of the scene's outputs, so that a file that cannot be written is reported before the work begins,
/// and so is a .vtp file where its program is not built (vtk_files.h).
/// @throw std::runtime_error naming the file and the fix.
OutputFiles open_outputs(const OutputDescription& output);

/// Writes the files under temporary names. commit_outputs then gives them their final names.
/// @throw std::runtime_error naming the file and the reason.
void write_outputs(const Render& render, const Scene& scene, OutputFiles& files);

/// Gives all files their final names, or none of them (commit_all). @throw std::runtime_error.
void commit_outputs(OutputFiles files);

/// The statistics of a render as JSON. `photons` counts rays; one position emits one ray for each wavelength. `power`
/// is the power of these rays, in the unit of the light's irradiance times area. Emitted light is counted where it
/// starts, the rest where it ends, and both balance: emitted = deposited + missed + side + stopped; `side` is there if
/// `integrator.side_light` leaves light out. `channels` has the counts of each wavelength. Of the method "scene",
/// `photons` has the photons of its lights by their end, also for each pass: emitted = before + landed + escaped +
/// stopped; `bent_rays` are those that are followed back, and `samples` those of the picture. `scene` is the path.
std::string statistics_json(const Scene& scene, const Statistics& statistics, double seconds_writing, int threads);

}  // namespace tensorray
