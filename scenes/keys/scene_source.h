#pragma once
/// @file scenes/keys/scene_source.h
/// The file from which a scene was read. Errors name it, and relative paths are relative to its folder.

#include <filesystem>
#include <stdexcept>
#include <string>

namespace tensorray {

/// The scene file is wrong. The message is one line: what is wrong, where (file and JSON pointer, or line and column),
/// and the fix.
struct SceneError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// `text` for a message of one line: control characters are escaped, and the middle of a long text is left out.
std::string printable(const std::string& text);

struct SceneSource {
  std::filesystem::path path;  ///< The scene file.

  /// The file that a path in the scene file means: a relative path is relative to the scene file's folder.
  std::filesystem::path resolve(const std::filesystem::path& written) const;

  /// @throw SceneError "PATH: WHAT".
  [[noreturn]] void fail(const std::string& what) const;
};

}  // namespace tensorray
