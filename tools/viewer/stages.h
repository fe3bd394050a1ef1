#pragma once
/// What a page may ask for, the pictures that it gets of one scene, coarse ones first, and what stays valid of them.

#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include <Eigen/Core>

#include "base/process/progress.h"
#include "scenes/description/description.h"
#include "scenes/keys/json_reader.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

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

/// Whether two scenes differ in these keys of `integrator` alone.
bool differ_in(const std::vector<const char*>& keys, const Json& scene, const Json& other);

/// The scene of a stage.
/// @param resolution  Of the plate, in the finished picture.
Json at_stage(const Json& scene, const SceneDescription& description, const Eigen::Vector2i& resolution,
              const Stage& stage);

/// The files whose kinds the stage makes, as files of `folder`.
std::vector<std::filesystem::path> outputs_of(const SceneDescription& description, const Stage& stage,
                                              const std::filesystem::path& folder);

/// Renders one version of a scene after another, and keeps what a change leaves valid:
/// - the field, while `field` changes only in `scale` and `bounds`;
/// - what "auto" chose for scale and direction, while `field` (but `scale`), `light.direction` and `light.up` stay;
/// - what the method keeps of the field (KeptResults), while the field stays;
/// - the picture in linear light, while `output` changes only in `exposure`, `display` and `view`.
/// Each picture is the same, bit for bit, as if rendered from the beginning. One thread at a time may use it.
class LiveScene {
 public:
  /// @param file  The scene's file; its folder is that of relative paths.
  /// @param imported  The field that was made of it, if it is another program's.
  explicit LiveScene(std::filesystem::path file, std::filesystem::path imported = {})
      : file_(std::move(file)), imported_(std::move(imported)) {}

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
  std::filesystem::path file_, imported_;
  std::optional<Scene> scene_;
  Json loaded_, rendered_;        ///< What scene and picture were made of.
  Json of_scale_, of_direction_;  ///< What the automatic choices depend on.
  std::optional<double> scale_;
  std::optional<Eigen::Vector3d> direction_;
  std::shared_ptr<const Render> render_;
};

}  // namespace tensorray
