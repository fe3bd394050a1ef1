#pragma once
/// @file scenes/check_scene.h
/// What must hold between the values of a scene file, beyond each one's own limits.

#include "scenes/description.h"
#include "scenes/json_reader.h"
#include "scenes/scene_source.h"

namespace tensorray {

/// Adds to `scene.warnings` what is allowed but likely a mistake.
/// @param json  The scene as written, to tell what was given from what is a default.
/// @throw SceneError with the JSON pointer of what is wrong.
void check_scene(SceneDescription& scene, const Json& json, const SceneSource& source);

}  // namespace tensorray
