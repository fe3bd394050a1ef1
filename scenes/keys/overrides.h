#pragma once
/// @file scenes/keys/overrides.h
/// Changes to a scene from the command line.

#include <string>

#include "scenes/keys/json_reader.h"

namespace tensorray {

/// Applies "KEY=VALUE" (see read_scene) to a scene. Objects on the way to KEY are made where there are none; an index
/// one past the end of a list appends to it.
/// @throw SceneError: not of that form, a way through a value that is no object or list, an index out of range.
void apply_override(Json& scene, const std::string& text);

}  // namespace tensorray
