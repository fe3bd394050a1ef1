#pragma once
/// @file scenes/scene/scene.h
/// All that a render needs. Immutable once loaded.

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "integrators/bending/bending.h"
#include "integrators/bending/light_channel.h"
#include "integrators/probes/auto_scale.h"
#include "renderer/color/color.h"
#include "renderer/color/spectrum.h"
#include "renderer/lights/beam.h"
#include "renderer/surfaces/geometry.h"
#include "scenes/description/description.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {

struct Scene {
  Scene(SceneDescription d, TensorField f, Geometry g, ColorManagement c)
      : description(std::move(d)), field(std::move(f)), geometry(std::move(g)), color(std::move(c)) {}

  SceneDescription description;
  TensorField field;  ///< Preprocessed; in the units of its file.
  Geometry geometry;
  ColorManagement color;
  Beam beam;
  BendingSettings bending;  ///< With the field's scale.

  /// What travels: wavelength bands, or in RGB mode the three primaries (wavelength 0), and their flexibilities.
  std::vector<Band> bands;
  std::vector<LightChannel> channels;

  std::shared_ptr<const LoadedMethod> method;  ///< Which renders the scene.

  EigenvalueReport eigenvalues;
  AutoScale scale;
  std::size_t non_finite = 0;      ///< Voxels that were not finite, and are taken as empty.
  std::vector<std::string> notes;  ///< What was chosen or found, a line each, for the user to read.
  double seconds = 0;              ///< That loading took.
};

/// SceneDescription → Scene: fields, meshes and spectra are loaded, and everything that was left to be chosen is.
/// @throw std::runtime_error, one line that names the file and the fix; SceneError where the scene's values do not go
/// with what was loaded; Cancelled.
Scene load_scene(const SceneDescription& description, const Progress& progress);

/// Where the volume begins and ends along a direction, as distances from `origin`.
struct DepthRange {
  double near = 0, far = 0;
};
DepthRange depth_range(const TensorField& field, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

/// @param pointer  Of the rectangle's keys in the scene file.
/// @throw SceneError if the rectangle is so large, or so far from the volume, that single precision would lose it.
void require_near(const Plate& plate, const char* pointer, const SceneDescription& description,
                  const TensorField& field);

/// Whether the scene's light has a white that pictures can be adapted to: nearly monochromatic light has none, its
/// colour is what one wants to see.
bool has_white(const Scene& scene);

/// From XYZ to the working space; the light's own white becomes neutral if the scene wants it so.
Eigen::Matrix3d to_working(const Scene& scene);

}  // namespace tensorray
