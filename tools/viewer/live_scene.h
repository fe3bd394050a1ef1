#pragma once
/// @file tools/viewer/live_scene.h
/// A scene whose keys change from picture to picture, and what of its last picture is still valid.

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "base/process/progress.h"
#include "scenes/keys/json_reader.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// Renders one version of a scene after another, and keeps what a change leaves valid:
/// - the field, while `field` changes only in `scale` and `bounds`;
/// - what "auto" chose for scale and direction, while `field` (but `scale`), `light.direction` and `light.up` stay;
/// - the rays of the light on a plate, up to where they leave the volume, while `field`, `bending` and the direction of
///   the light stay;
/// - what the method keeps of the field (KeptResults), while the field stays;
/// - the picture in linear light, while `output` changes only in `exposure`, `display` and `view`.
/// Each picture is the same, bit for bit, as if its scene were loaded and rendered from the beginning. One thread at a
/// time may use it.
class LiveScene {
 public:
  /// @param file  The scene's file; its folder is that of relative paths.
  explicit LiveScene(std::filesystem::path file) : file_(std::move(file)) {}

  /// The scene of `json`, loaded. It is valid until the next call. If the call throws, the scene, and its picture, stay
  /// those before: where the field changes, both fields are in memory for a moment.
  /// @param outputs  Names of files whose kinds the render makes (".png" and others). They are not written.
  /// @throw As read_scene and load_scene.
  const Scene& load(const Json& json, const std::vector<std::filesystem::path>& outputs, const Progress& progress);

  /// Renders the loaded scene, if that is needed. @throw As tensorray::render.
  std::shared_ptr<const Render> render(const Progress& progress);

  /// Whether `render` would return at once after `load`.
  bool has_picture(const Json& json, const std::vector<std::filesystem::path>& outputs) const;

  const Scene& scene() const { return *scene_; }

 private:
  std::filesystem::path file_;
  std::optional<Scene> scene_;
  Json loaded_, chosen_for_, rendered_;  ///< What scene, automatic choices and picture were made of.
  Json rays_of_;                         ///< What the rays depend on.
  std::optional<double> scale_;
  std::optional<Eigen::Vector3d> direction_;
  std::shared_ptr<const Render> render_;
};

}  // namespace tensorray
