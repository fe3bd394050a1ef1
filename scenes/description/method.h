#pragma once
/// @file scenes/description/method.h
/// The seam between a scene and the methods that make pictures of it. A method owns its keys, what it loads, how it
/// renders and what it writes; all else asks it through this interface. scenes/pipeline/methods.cpp lists the methods.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/distinct_files.h"
#include "scenes/keys/json_reader.h"
#include "scenes/keys/scene_source.h"
#include "scenes/keys/schema_writer.h"
#include "scenes/keys/section_reader.h"

namespace tensorray {

struct Progress;
struct Render;
struct Scene;
struct SceneDescription;

/// A kind of file that a method can write.
struct Output {
  const char* key;                   ///< Under `output` in the scene file.
  const char* meaning;               ///< For the schema and for `--help`.
  std::vector<std::string> endings;  ///< Of its files.

  /// Writes the file. @throw std::runtime_error naming the file.
  void (*write)(const std::filesystem::path& file, const Scene& scene, const Render& render);

  /// The ending by which `-o FILE` knows the kind, where another kind has the same endings: ".spectral.exr".
  const char* option_ending = nullptr;
};

/// A method with all that it needs of a scene loaded. Immutable: any number of threads may render with it.
class LoadedMethod {
 public:
  virtual ~LoadedMethod() = default;

  /// @throw Cancelled; std::runtime_error; SceneError where the scene's values do not go with what was found.
  virtual Render render(const Scene& scene, const Progress& progress) const = 0;
};

/// A method's settings as the scene file gives them. All methods are read from every scene file, so that one file
/// serves them all and `--set integrator.type=...` chooses among them.
class Method {
 public:
  virtual ~Method() = default;

  /// The word of `integrator.type`.
  virtual const char* name() const = 0;

  /// Lets the visitor see the method's keys, which stand in `integrator`.
  virtual void visit(SectionReader& reader) = 0;
  virtual void visit(SchemaWriter& writer) = 0;

  /// What the method can write.
  virtual std::vector<Output> outputs() const = 0;

  /// Files that its keys name, and that it reads.
  virtual std::vector<NamedFile> inputs() const { return {}; }

  /// Checks the method's keys beside each other and beside the rest of the scene, and adds to `scene.warnings`.
  /// @param chosen  Whether this is the method that renders the scene.
  /// @throw SceneError through `source`.
  virtual void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const;

  /// Loads what the method needs beside the scene. @param notes  Lines for the user to read are added.
  /// @throw as load_scene.
  virtual std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const = 0;
};

/// A method whose settings are a struct with a `describe` function (see scene_keys.h).
template <class Settings>
class MethodWith : public Method {
 public:
  const Settings& settings() const { return settings_; }
  void visit(SectionReader& reader) override { describe(settings_, reader); }
  void visit(SchemaWriter& writer) override { describe(settings_, writer); }

 private:
  Settings settings_;
};

}  // namespace tensorray
