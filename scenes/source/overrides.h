#pragma once
/// @file scenes/source/overrides.h
/// Keys by their names, as "light.photons": changes to a scene from the command line, and values in captions.

#include <string>

#include "scenes/keys/json_reader.h"

namespace tensorray {

/// Applies "KEY=VALUE" (see read_scene) to a scene. Objects that KEY names and that do not exist are made. An index one
/// past the end of a list appends an item.
/// @throw SceneError: the text does not have that form, KEY leads through a value that is neither object nor list, or
/// an index is out of range.
void apply_override(Json& scene, const std::string& text);

/// Replaces each {field.scale} by the value of this key at the scene's frame: numbers with four digits, lists with
/// commas. Keys are named as by --set.
/// @throw SceneError if the scene does not give such a key, or a brace has no partner.
std::string with_values(const std::string& caption, const Json& scene, const SceneSource& source);

}  // namespace tensorray
