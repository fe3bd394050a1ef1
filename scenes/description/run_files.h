#pragma once
/// @file scenes/description/run_files.h
/// All files that a render of a scene reads and writes.

#include "base/distinct_files.h"
#include "scenes/description/description.h"

namespace tensorray {

/// The scene file and all files that it names, of all methods; the OCIO config of the environment.
std::vector<NamedFile> input_files(const SceneDescription& scene);
std::vector<NamedFile> output_files(const SceneDescription& scene);

/// @param more  Outputs beside those of the scene.
/// @throw SceneError if an output is the same file as an input or as another output.
void check_files(const SceneDescription& scene, const std::vector<NamedFile>& more = {});

}  // namespace tensorray
