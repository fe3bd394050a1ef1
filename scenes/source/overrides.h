#pragma once
/// @file scenes/source/overrides.h
/// Applies changes to a scene from the command line.

#include <string>

#include "scenes/keys/json_reader.h"

namespace tensorray {

/// Applies "KEY=VALUE" (see read_scene) to a scene. Objects that KEY names and that do not exist are made. An index one
/// past the end of a list appends an item.
/// @throw SceneError: the text does not have that form, KEY leads through a value that is neither object nor list, or
/// an index is out of range.
void apply_override(Json& scene, const std::string& text);

}  // namespace tensorray
