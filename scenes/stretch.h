#pragma once
/// @file scenes/stretch.h
/// How a scene's field stretches bundles of its light (integrators/probes/stretch.h), as a grid and as a picture.

#include <map>
#include <optional>
#include <string>

#include "integrators/probes/stretch.h"
#include "renderer/images/image.h"
#include "scenes/load_scene.h"

namespace tensorray {

/// What may be asked for beside the scene.
struct StretchRequest {
  std::optional<double> length;      ///< World units; none: the volume's depth along the light.
  std::optional<double> wavelength;  ///< nm; none: 550, in RGB mode green.
  int resolution = 64;               ///< Of the grid: voxels along the longest side.
  int pixels = 512;                  ///< Of the picture: along the longer side.
};

/// A picture, and what its colours mean.
struct StretchPicture {
  Image linear;   ///< R, G, B, A (0: light does not meet the volume, or does not come so far) and `stretch`.
  Image display;  ///< R, G, B, A as sRGB, with a colour bar.
};

/// Light that goes into the volume, of one flexibility.
/// @throw std::invalid_argument if the length is not positive, or a wavelength is asked for in RGB mode.
StretchSettings choose_stretch(const Scene& scene, const StretchRequest& request);

/// From a lattice in the volume; with all that is to be known of it as metadata. @throw Cancelled.
ScalarGrid stretch_grid(const Scene& scene, const StretchSettings& settings, int resolution, const Progress& progress);

/// From the plane across the light that touches the volume, where light comes to it: seen along the light, as the
/// plate is. @throw Cancelled.
StretchPicture stretch_picture(const Scene& scene, const StretchSettings& settings, int pixels,
                               const Progress& progress);

/// As stretch_grid's metadata: the settings, and where they are from.
std::map<std::string, std::string> stretch_metadata(const Scene& scene, const StretchSettings& settings);

}  // namespace tensorray
