#pragma once
/// @file scenes/description/run_files.h
/// Lists and checks all files that a render of a scene reads and writes.

#include "base/files/distinct_files.h"
#include "scenes/description/description.h"

namespace tensorray {

/// The scene file, all input files that it names for any method, and the OCIO config of the environment ($OCIO).
std::vector<NamedFile> input_files(const SceneDescription& scene);

/// The files that the scene writes.
std::vector<NamedFile> output_files(const SceneDescription& scene);

/// @param more  Further outputs of the run, in addition to those of the scene. @param read  Further inputs.
/// @throw SceneError if an output is the same file as an input or as another output.
void check_files(const SceneDescription& scene, const std::vector<NamedFile>& more = {},
                 const std::vector<NamedFile>& read = {});

}  // namespace tensorray
