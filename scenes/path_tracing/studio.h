#pragma once
/// @file scenes/path_tracing/studio.h
/// Camera and lights of a picture of paths, where the scene gives them and where it does not.

#include <vector>

#include <Eigen/Geometry>

#include "renderer/lights/lights.h"
#include "renderer/shading/camera.h"
#include "scenes/path_tracing/load_paths.h"
#include "scenes/path_tracing/path_tracing_description.h"

namespace tensorray {

/// The scene's camera; without a position, one that sees all of `points`.
/// @param free  Part of the picture's width that it then leaves free at the right.
/// @throw std::invalid_argument naming what does not go together.
Camera make_camera(const CameraDescription& description, const std::vector<Eigen::Vector3d>& points, double free);

/// The scene's lights; without any, a white sky, brighter above, and a lamp at the viewer's upper left.
std::vector<Light> make_lights(const SceneDescription& description, const PathScene& paths, const Camera& camera);

}  // namespace tensorray
