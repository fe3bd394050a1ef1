#pragma once
/// @file integrators/path_tracing/studio.h
/// Camera and lights of a picture of paths: those of the scene, or defaults.

#include <vector>

#include <Eigen/Geometry>

#include "integrators/path_tracing/load_paths.h"
#include "integrators/path_tracing/path_tracing_description.h"
#include "renderer/camera/camera.h"
#include "renderer/lights/lights.h"

namespace tensorray {

/// The camera of the scene; if it has no position, a camera that shows all of `points`.
/// @param free  Part of the picture's width that such a camera leaves free at the right.
/// @throw std::invalid_argument naming the values that do not fit together.
Camera make_camera(const CameraDescription& description, const std::vector<Eigen::Vector3d>& points, double free);

/// The lights of the scene; if it has none, a white sky and a lamp at the viewer's upper left.
std::vector<Light> make_lights(const SceneDescription& description, const ShownLights& shown, const Camera& camera);

}  // namespace tensorray
