#pragma once
/// @file scenes/path_tracing/load_paths.h
/// What path tracing needs beside the field: the rays to follow, and the light that shows them.

#include <vector>

#include "integrators/paths/paths.h"
#include "renderer/color/reflectance.h"
#include "renderer/lights/lights.h"
#include "scenes/path_tracing/path_tracing_description.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The bands of the light that shows the paths, and what colours are in it.
struct ShownLight {
  std::vector<Band> bands;
  Eigen::Matrix3d xyz_to_working;     ///< The light's white is neutral.
  Eigen::Matrix3d rec709_to_working;  ///< Of the colours that scene files give.
  ReflectanceModel model;

  /// Of each band: the spectrum of a colour of linear Rec. 709, times a factor.
  std::vector<float> radiance(const Eigen::Vector3d& rec709, double factor) const;
};

struct PathScene {
  PathTracingDescription settings;
  std::vector<PathSeed> seeds;
  std::vector<Path> paths;  ///< If they were read from a file: there are no seeds then.
  ShownLight light;
  std::vector<EnvironmentLight> environments;  ///< Those of the scene's lights, in their order.
};

/// @throw std::runtime_error naming the file that cannot be read; SceneError where the scene's values do not go with
/// what was loaded.
PathScene load_paths(const Scene& scene, const PathTracingDescription& settings);

}  // namespace tensorray
