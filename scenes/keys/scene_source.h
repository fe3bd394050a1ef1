#pragma once
/// @file scenes/keys/scene_source.h
/// Where a scene was read from: named in errors, and what relative paths are relative to.

#include <filesystem>
#include <stdexcept>
#include <string>

namespace tensorray {

/// The scene file is wrong. The message is one line: what, where (file and JSON pointer, or line and column), the fix.
struct SceneError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// `text` fit for a message of one line: control characters are escaped, and the middle of a long text is left out.
std::string printable(const std::string& text);

struct SceneSource {
  std::filesystem::path path;  ///< The scene file.

  /// A path of the scene file, relative ones taken relative to the scene file's folder.
  std::filesystem::path resolve(const std::filesystem::path& written) const;

  /// @throw SceneError "scene.json: what".
  [[noreturn]] void fail(const std::string& what) const;
};

}  // namespace tensorray
