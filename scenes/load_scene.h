#pragma once
/// @file scenes/load_scene.h
/// SceneDescription → Scene: fields, meshes and spectra are loaded, and everything that was left to be chosen is.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "integrators/bending/bending.h"
#include "integrators/photons/photon_distribution.h"
#include "integrators/probes/auto_scale.h"
#include "renderer/color/color.h"
#include "renderer/color/spectrum.h"
#include "renderer/lights/beam.h"
#include "renderer/surfaces/geometry.h"
#include "scenes/description.h"
#include "scenes/load_lens.h"
#include "scenes/load_paths.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// All that a render needs. Immutable once loaded.
struct Scene {
  SceneDescription description;
  TensorField field;        ///< Preprocessed, in the units of its file.
  BendingSettings bending;  ///< With the field's scale.
  Geometry geometry;
  Beam beam;
  ColorManagement color;
  std::optional<LensScene> lens;   ///< If it is what the scene is rendered by.
  std::optional<PathScene> paths;  ///< The same.

  /// What travels: wavelength bands, or in RGB mode the three primaries (wavelength 0), and their flexibilities.
  std::vector<Band> bands;
  std::vector<LightChannel> channels;

  EigenvalueReport eigenvalues;
  AutoScale scale;
  bool scale_chosen = false;       ///< Whether the scale was "auto".
  std::size_t non_finite = 0;      ///< Voxels that were not finite, and are taken as empty.
  std::vector<std::string> notes;  ///< What was chosen or found, a line each, for the user to read.
  double seconds = 0;              ///< That loading took.
};

/// @throw std::runtime_error, one line that names the file and the mend; SceneError where the scene's values do not go
/// with what was loaded; Cancelled.
Scene load_scene(const SceneDescription& description, const Progress& progress);

}  // namespace tensorray
