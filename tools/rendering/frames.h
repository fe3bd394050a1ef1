#pragma once
/// @file tools/rendering/frames.h
/// Renders sequences: a frame is a unit.

#include <filesystem>
#include <vector>

#include "tools/rendering/render_scene.h"

namespace tensorray {

/// Renders frames of a scene (see set_frame), one after the other; of ranks, each renders every so many. The scale and
/// the direction `auto` are those of the first frame. A field that does not change is loaded once.
/// @return the frames that failed, where the run keeps going, at the root; they were named on standard error.
/// @throw as render_scene; SceneError if the names of files do not count frames, so that one would replace another.
std::vector<int> render_frames(const std::filesystem::path& scene_file, SceneChanges changes, std::vector<int> frames,
                               const RenderRun& run, Progress& progress);

}  // namespace tensorray
