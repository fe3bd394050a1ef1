#pragma once
/// The interface between a scene and the methods that make pictures of it. A method defines its keys, what it loads,
/// how it renders and what it writes. All other code uses a method through this interface.
/// integrators/methods/methods.cpp lists the methods.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/files/output_file.h"
#include "scenes/keys/key_visitor.h"

namespace tensorray {

struct Progress;
struct Render;
struct RenderJob;
struct Scene;
struct SceneDescription;

/// A kind of file that a method can write.
struct Output {
  const char* key;                   ///< Its key under `output` in the scene file.
  const char* meaning;               ///< Description for the schema and for `--help`.
  std::vector<std::string> endings;  ///< File name endings that are allowed.

  /// Writes the file. @throw std::runtime_error naming the file.
  void (*write)(const std::filesystem::path& file, const Scene& scene, const Render& render);

  /// The ending that selects this kind with `-o FILE`, if other kinds have the same endings: ".spectral.exr".
  /// Null: `endings` select it.
  const char* option_ending = nullptr;

  std::vector<std::string> option_endings() const {
    return option_ending ? std::vector<std::string>{option_ending} : endings;
  }

  /// The ending of `file` by which `-o` selects this kind; empty: it does not.
  std::string ending_of(const std::filesystem::path& file) const;
};

/// The key that says how strongly a picture shows the field, and the value that counts.
struct Strength {
  const char* section;
  const char* key;
  double value;
  bool is_fixed = false;  ///< A file gives the value: no number takes its place.
};

/// A method that has loaded everything that it needs for a scene. Immutable: any number of threads may render with it.
class LoadedMethod {
 public:
  virtual ~LoadedMethod() = default;

  /// @param job  Keeps the units of the work, and divides them; null: neither.
  /// @throw Cancelled; std::runtime_error; SceneError if a value of the scene does not fit the data.
  virtual Render render(const Scene& scene, const Progress& progress, RenderJob* job) const = 0;

  /// `field.scale`, unless it is another key.
  virtual Strength strength(const Scene& scene) const;
};

/// The settings of a method, as the scene file gives them. The settings of all methods are read from every scene file,
/// so that `--set integrator.type=...` can choose another method for the same file.
class Method {
 public:
  virtual ~Method() = default;

  /// The value of `integrator.type` that chooses this method.
  virtual const char* name() const = 0;

  /// Shows the method's keys, which are in `integrator`, to the visitor.
  virtual void visit(KeyVisitor& visitor) = 0;

  /// The kinds of output that the method can write.
  virtual std::vector<Output> outputs() const = 0;

  /// The channels that its EXR of the scene may have.
  virtual std::vector<std::string> channels(const SceneDescription& scene) const = 0;

  /// Whether its pictures have noise, which `integrator.max_samples` samples a pixel average.
  virtual bool is_sampled() const { return false; }

  /// Whether the pixels of its pictures are those of the plate.
  virtual bool shows_plate() const { return false; }

  /// Whether `light.direction` has an effect on the picture.
  virtual bool needs_light_direction(const SceneDescription&) const { return true; }

  /// The direction in which its picture looks through the field, if that is not along the light; the automatic scale
  /// shows both then. @param middle  Of the field.
  virtual std::optional<Eigen::Vector3d> view_through(const SceneDescription&,
                                                      const Eigen::Vector3d& /*middle*/) const {
    return std::nullopt;
  }

  /// Whether the field bends its light: it has a scale then, and a direction in which it shows most.
  virtual bool bends_light() const { return true; }

  /// Keys of `integrator` that change what is seen of the light, but no ray (KeptResults has what is traced).
  virtual std::vector<const char*> analysis_keys() const { return {}; }

  /// The files that the method reads, as its keys name them.
  virtual std::vector<NamedFile> inputs() const { return {}; }

  /// Checks the method's keys against each other and against the rest of the scene, and adds to `scene.warnings`.
  /// @param chosen  Whether this is the method that renders the scene.
  /// @throw SceneError through `source`.
  virtual void check(SceneDescription&, const Json&, const SceneSource&, bool /*chosen*/) const {}

  /// Loads what the method needs in addition to the scene. @param notes  The method adds lines for the user.
  /// @throw The same exceptions as load_scene.
  virtual std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const = 0;
};

/// A method whose settings are a struct with a `describe` function (see scene_keys.h).
template <class Settings>
class MethodWith : public Method {
 public:
  const Settings& settings() const { return settings_; }
  void visit(KeyVisitor& visitor) override { describe(settings_, visitor); }

 private:
  Settings settings_;
};

}  // namespace tensorray
