#pragma once
/// @file tools/commands/render_scene.h
/// Renders a scene file and writes its outputs.

#include <filesystem>
#include <vector>

#include "base/progress.h"
#include "scenes/pipeline/read_scene.h"

namespace tensorray {

struct RenderRun {
  unsigned threads = 0;              ///< Number of threads; 0: all.
  bool quiet = false;                ///< Print only errors.
  std::filesystem::path statistics;  ///< JSON file for the statistics; empty: none.
  std::filesystem::path scene_copy;  ///< File for the scene with its changes; empty: none.
};

/// Reads the scene file (or the field's; see read_scene), loads the scene, renders it and writes its outputs. Prints a
/// progress bar and notes.
/// @throw SceneError, std::invalid_argument, std::runtime_error, Cancelled.
void render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                  Progress& progress);

/// Renders frames of a scene (see set_frame), one after the other. The scale and the direction `auto` are those of the
/// first frame. A field that does not change is loaded once.
/// @param skip_existing  Leaves out frames of which all files exist.
/// @throw as render_scene; SceneError if the names of files do not count frames, so that one would replace another.
void render_frames(const std::filesystem::path& scene_file, SceneChanges changes, const std::vector<int>& frames,
                   bool skip_existing, const RenderRun& run, Progress& progress);

}  // namespace tensorray
