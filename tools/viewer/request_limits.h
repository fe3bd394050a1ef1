#pragma once
/// @file tools/viewer/request_limits.h
/// What a page may ask for.

#include <filesystem>
#include <set>

#include "scenes/description/description.h"

namespace tensorray {

/// The files that a page may name in a scene: those of the scene that the server was started with.
class AllowedFiles {
 public:
  explicit AllowedFiles(const SceneDescription& scene);

  /// @throw SceneError naming the key of a file that is not among them.
  void require(const SceneDescription& scene) const;

 private:
  std::set<std::filesystem::path> files_;
};

/// @throw SceneError naming the key, if the picture, the number of rays or a generated field is so large that it would
/// keep the server busy for long, or fill its memory.
void require_moderate(const SceneDescription& scene);

}  // namespace tensorray
