#pragma once
/// @file scenes/source/keyframe_schema.h
/// Keyframes (frames.h) in the JSON Schema of scenes.

#include "scenes/keys/json_reader.h"

namespace tensorray {

/// Lets keyframes take the place of every number, and of every list of numbers, of a schema. Their form is added to it
/// as `$defs/keyframes`.
void allow_keyframes(Json& schema);

}  // namespace tensorray
