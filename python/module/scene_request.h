#pragma once
/// A tensor field as Python holds it, a scene as Python asks for it, and words of scene files as arguments.

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/numpy.h>

#include "scenes/description/choices.h"
#include "scenes/description/description.h"
#include "scenes/keys/json_reader.h"
#include "scenes/keys/values.h"
#include "scenes/scene/scene.h"
#include "volumes/grids/block_source.h"

namespace tensorray {

/// Where voxels come from, and, once light was traced through them, their bricks. The voxels are made when they are
/// first needed, so that an array of the user's is not copied twice. Any number of threads may use one.
class Field {
 public:
  /// @param keys    `field` of a scene that has this field. Renders write it into the headers of their files.
  /// @param blocks  The voxels. Filling a block must not touch Python's objects.
  /// @param memory  What the blocks read; kept alive. None: nothing.
  Field(Json keys, BlockSource blocks, pybind11::object memory = pybind11::none())
      : keys_(std::move(keys)), blocks_(std::move(blocks)), memory_(std::move(memory)) {}

  const Json& keys() const { return keys_; }
  std::string source() const;  ///< Names the field in notes and errors.
  TensorGrid grid() const { return to_grid(blocks_); }
  const TriangleMesh& surface() const { return blocks_.surface; }

  /// The field without voxels that are not finite, smoothed and preprocessed. Made anew if a choice or the turn
  /// differs.
  /// @param turn  A rotation, of all fields but those that are generated.
  LoadedField loaded(const FieldChoices& choices, const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) const;

 private:
  Json keys_;
  BlockSource blocks_;
  pybind11::object memory_;
  mutable std::mutex mutex_;
  mutable FieldChoices choices_;
  mutable Eigen::Matrix3d turn_ = Eigen::Matrix3d::Identity();
  mutable std::optional<LoadedField> loaded_;
};

/// Python makes it.
struct SceneRequest {
  std::filesystem::path file;        ///< The scene's file, or a field's; without `json`, it is read.
  std::string json;                  ///< The scene itself. Relative paths are relative to the folder of `file`.
  std::vector<std::string> changes;  ///< "KEY=VALUE", as SceneChanges::overrides.
  std::optional<int> frame;          ///< Of a scene with keyframes.
  std::shared_ptr<Field> field;      ///< Replaces the scene's own field; null: the scene has one.
  std::vector<std::filesystem::path> outputs;  ///< Files that are written.
  std::vector<std::string> keep;               ///< Kinds of output, by key, that are made but not written.
};

struct RequestedScene {
  SceneDescription description;                        ///< Its output files are all that is made.
  std::map<std::string, std::filesystem::path> files;  ///< Those of them that are written, by the key of their output.
};

/// Reads and checks the scene. @throw SceneError; std::invalid_argument.
RequestedScene read_request(const SceneRequest& request);

/// Loads it. @throw as load_scene.
Scene load_request(const SceneRequest& request, const RequestedScene& scene, const Progress& progress);

/// The value of a word, as scene files have it. @throw std::invalid_argument that lists the words.
template <class Enum>
Enum value_of(const std::string& argument, const std::string& word) {
  Enum value{};
  if (!Value<Enum>::read(Json(word), {}, value))
    throw std::invalid_argument(argument + " must be " + Value<Enum>::expectation(value, {}));
  return value;
}

// The parts of the module tensorray._tensorray, one a source file:

void add_fields(pybind11::module_& module);         ///< Field and its functions.
void add_scene_request(pybind11::module_& module);  ///< SceneRequest.
void add_renders(pybind11::module_& module);        ///< `render` with its result, and the functions for shards.
void add_traces(pybind11::module_& module);         ///< `trace` and `landings`.

}  // namespace tensorray
