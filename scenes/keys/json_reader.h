#pragma once
/// @file scenes/keys/json_reader.h
/// Text → JSON, stricter than JSON itself: no key twice in an object, no deep nesting.

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace tensorray {

using Json = nlohmann::ordered_json;

/// Values may be nested this deep. Scenes need 4; without a limit a hostile file could exhaust the stack.
constexpr int nesting_limit = 64;

/// The JSON object in a file; comments are allowed.
/// @throw SceneError: the file is missing, a folder, unreadable, empty, too large, not JSON (with line and column), or
/// its value is not an object.
Json read_json_object(const std::filesystem::path& path);

/// JSON without comments. @throw nlohmann::json::exception if it is none, or SceneError if it breaks the rules above.
Json parse_value(const std::string& text);

}  // namespace tensorray
