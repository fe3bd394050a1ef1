#pragma once
/// @file tools/viewer/stages.h
/// What a page may ask for, and the pictures that it gets of one scene: coarse ones first.

#include <deque>
#include <filesystem>
#include <set>
#include <vector>

#include <Eigen/Core>

#include "scenes/description/description.h"

namespace tensorray {

/// The files that a scene names, without symbolic links.
std::set<std::filesystem::path> resolved_files(const SceneDescription& scene);

/// @throw SceneError naming the key of a file that is not among those of the scene that the server was started with.
void require_files(const SceneDescription& scene, const std::set<std::filesystem::path>& allowed);

/// @throw SceneError naming the key, if the picture, the number of rays or a generated field is so large that it would
/// keep the server busy for long, or fill its memory.
void require_moderate(const SceneDescription& scene);

/// How one picture of a scene is made.
struct Stage {
  int coarseness = 1;        ///< Edge of its pixels, in pixels of the finished picture.
  int samples = 0;           ///< Greatest number of samples a pixel; 0: that of the scene.
  bool all_outputs = false;  ///< Whether the picture comes with all that a page can ask of it.
  bool is_known = false;     ///< Whether the page has this picture already.

  bool is_first() const { return coarseness > 1 && samples == 1; }
  bool is_final() const { return coarseness == 1 && samples == 0; }
};

/// @param coarseness  Of the first stage; a power of two.
/// @param is_sampled  Method::is_sampled.
std::deque<Stage> stages_of(int coarseness, bool is_sampled);

/// The scene of a stage.
/// @param resolution  Of the plate, in the finished picture.
Json at_stage(const Json& scene, const SceneDescription& description, const Eigen::Vector2i& resolution,
              const Stage& stage);

/// The files whose kinds the stage makes, as files of `folder`.
std::vector<std::filesystem::path> outputs_of(const SceneDescription& description, const Stage& stage,
                                              const std::filesystem::path& folder);

}  // namespace tensorray
