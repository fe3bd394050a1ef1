#pragma once
/// @file scenes/source/caption.h
/// Values of keys in the line that is drawn over a picture (`output.caption`).

#include <string>

#include "scenes/keys/json_reader.h"
#include "scenes/keys/scene_source.h"

namespace tensorray {

/// Replaces each {field.scale} by the value of this key at the scene's frame: numbers with four digits, lists with
/// commas. Keys are named as by --set.
/// @throw SceneError if the scene does not give such a key, or a brace has no partner.
std::string with_values(const std::string& caption, const Json& scene, const SceneSource& source);

}  // namespace tensorray
