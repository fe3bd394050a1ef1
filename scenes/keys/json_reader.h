#pragma once
/// @file scenes/keys/json_reader.h
/// Text → JSON. Stricter than JSON itself: an object must not have a key twice, and nesting must not be deep.

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace tensorray {

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
