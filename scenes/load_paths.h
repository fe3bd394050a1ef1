#pragma once
/// @file scenes/load_paths.h
/// What path tracing needs beside the field: the rays to follow, and the light that shows them.

#include <vector>

#include "integrators/paths/paths.h"
#include "integrators/photons/photon_distribution.h"
#include "renderer/color/color.h"
#include "renderer/color/reflectance.h"
#include "renderer/lights/beam.h"
#include "renderer/lights/lights.h"
#include "scenes/description.h"
#include "volumes/bricks/tensor_field.h"

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
  std::vector<PathSeed> seeds;
  std::vector<Path> paths;  ///< If they were read from a file: there are no seeds then.
  ShownLight light;
  std::vector<EnvironmentLight> environments;  ///< Those of the scene's lights, in their order.
};

/// @param light  The spectrum of the light.
/// @throw std::runtime_error naming the file that cannot be read; SceneError where the scene's values do not go with
/// what was loaded.
PathScene load_paths(const SceneDescription& description, const TensorField& field, const ColorManagement& color,
                     const Spectrum& light, const std::vector<LightChannel>& channels, const Beam& beam);

}  // namespace tensorray
