#pragma once
/// @file scenes/description/check_scene.h
/// What must hold between the values of a scene file, beyond each one's own limits.

#include "scenes/description/description.h"

namespace tensorray {

/// Adds to `scene.warnings` what is allowed but likely a mistake, and removes outputs that the method cannot make.
/// @param json  The scene as written, to tell what was given from what is a default.
/// @throw SceneError with the JSON pointer of what is wrong.
void check_scene(SceneDescription& scene, const Json& json, const SceneSource& source);

// For the checks of methods:

/// Whether the scene file gives the key at a JSON pointer.
bool given(const Json& json, const char* pointer);

/// Warns that `key` has no effect where both are given.
void warn_unused(SceneDescription& scene, const Json& json, const char* key, const char* because_of);

/// @throw SceneError if the plane is across the light, so that it would be seen edge-on.
void check_normal(const std::optional<Eigen::Vector3d>& normal, const char* pointer, const LightDescription& light,
                  const SceneSource& source);

/// @throw SceneError if so much memory is more than any sensible picture needs. @param what  What to ask for less of.
void check_memory(double bytes, const std::string& what, const SceneSource& source);

/// Checks the memory of planes of light on the receiver. @param bytes_per_pixel  What a method needs beside them.
void check_receiver_memory(const SceneDescription& scene, double bytes_per_pixel, const SceneSource& source);

/// Light of three flexibilities has no wavelengths.
/// @throw SceneError if a spectral picture of the light is asked for beside `bending.rgb`.
void check_spectral_output(const SceneDescription& scene, const SceneSource& source);

}  // namespace tensorray
