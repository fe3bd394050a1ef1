#pragma once
/// @file tools/commands/render_scene.h
/// From scene file to pictures.

#include <filesystem>

#include "base/progress.h"
#include "scenes/pipeline/read_scene.h"

namespace tensorray {

struct RenderRun {
  unsigned threads = 0;              ///< 0: all.
  bool quiet = false;                ///< Prints nothing but errors.
  std::filesystem::path statistics;  ///< JSON file to write; empty: none.
};

/// Reads the scene file, loads the scene, renders it and writes its outputs, with a progress bar and notes.
/// @throw SceneError, std::invalid_argument, std::runtime_error, Cancelled.
void render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                  Progress& progress);

}  // namespace tensorray
