#pragma once
/// Text → JSON. Stricter than JSON itself: an object must not have a key twice, and nesting must not be deep.

#include <filesystem>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

namespace tensorray {

/// The scene file is wrong. The message is one line: what is wrong, where (file and JSON pointer, or line and column),
/// and the fix.
struct SceneError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// `text` for a message of one line: control characters are escaped, and the middle of a long text is left out.
std::string printable(const std::string& text);

/// The file from which a scene was read. Errors name it, and relative paths are relative to its folder.
struct SceneSource {
  std::filesystem::path path;  ///< The scene file.
  bool is_y_up = false;        ///< Its positions and directions are turned when they are read, so that z is up.

  /// The file that a path in the scene file means: a relative path is relative to the scene file's folder.
  std::filesystem::path resolve(const std::filesystem::path& written) const;

  /// @throw SceneError "PATH: WHAT".
  [[noreturn]] void fail(const std::string& what) const;
};

using Json = nlohmann::ordered_json;

/// Greatest depth of nested values. Scenes need 4; without a limit, a hostile file could exhaust the stack.
constexpr int nesting_limit = 64;

/// Reads a file that contains one JSON object; comments are allowed.
/// @throw SceneError: the file is missing, a folder, unreadable, empty, too large, not JSON (with line and column), or
/// its value is not an object.
Json read_json_object(const std::filesystem::path& path);

/// Reads JSON without comments.
/// @throw nlohmann::json::exception if `text` is not JSON; SceneError if it breaks the stricter rules of this file.
Json parse_value(const std::string& text);

}  // namespace tensorray
