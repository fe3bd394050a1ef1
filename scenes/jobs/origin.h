#pragma once
/// @file scenes/jobs/origin.h
/// What units of work belong to: everything that their bytes depend on.

#include <string>

#include "scenes/keys/json_reader.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The version of the program; the method; the scene with its changes, but without its output files; the scale and the
/// direction of the light, which a scene may leave open; and the hash of each file that the scene reads.
/// @throw std::runtime_error naming a file that cannot be read.
Json origin_of(const Scene& scene);

/// Whether a file's JSON has all that an origin has.
bool is_origin(const Json& json);

/// The first difference between two origins, as "`/camera/resolution` is [800,800] there, [400,400] here"; empty if
/// there is none. @param there  Of a file. @param here  Of the scene that is loaded.
std::string difference(const Json& there, const Json& here);

/// Sets what a scene leaves open to what the origin has. The scene must be that of the origin.
void set_chosen(const Json& origin, SceneDescription& description);

}  // namespace tensorray
