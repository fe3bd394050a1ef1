#pragma once
/// @file scenes/render.h
/// Scene → Render: the switch over the methods.

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "base/progress.h"
#include "integrators/paths/paths.h"
#include "integrators/photons/photon_distribution.h"
#include "renderer/film/spectral_image.h"
#include "renderer/images/image.h"
#include "scenes/load_scene.h"

namespace tensorray {

struct Statistics {
  std::uint64_t positions = 0;  ///< From which light was emitted.
  std::vector<EndCounts> ends;  ///< Rays by channel and end.
  std::vector<double>
      channel_power;  ///< Of one ray, by channel, the beam's irradiance being 1; empty if rays carry none.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  double seconds_tracing = 0, seconds_density = 0, seconds_drawing = 0, seconds_color = 0;
};

/// What a method made, ready to be written.
struct Render {
  Image linear;  ///< R, G, B in the scene-linear working space (1 is the undisturbed light, or the image's white); then
                 ///< A, multiplied in, and other channels, if the method has them.
  std::optional<SpectralImage> spectral;  ///< If the scene asks for it.
  PhotonMap photons;                      ///< If the scene asks for it.
  std::vector<ScalarGrid> fluence;        ///< The same.
  std::vector<Path> paths;                ///< Of path tracing.
  std::optional<double> exposure;         ///< Stops at which it is well shown; none: by its brightness.
  ImageMetadata metadata;                 ///< What the method has to say of the picture, for its header.
  /// Writes the tubes about `paths`; empty unless the scene asks for them.
  std::function<void(const std::filesystem::path&, const std::vector<Path>& paths)> write_tubes;
  std::function<void(Image&)> annotate;  ///< Draws a legend over a scene-linear picture; empty: there is none.
  Statistics statistics;
};

/// Whether the scene's light has a white that pictures can be adapted to: nearly monochromatic light has none, its
/// colour is what one wants to see.
bool has_white(const Scene& scene);

/// From XYZ to the working space; the light's own white becomes neutral if the scene wants it so.
Eigen::Matrix3d to_working(const Scene& scene);

/// The light of the scene on its plate: a plane for each band, or if no output needs the bands, for red, green and
/// blue.
PhotonDistribution distribute_photons(const Scene& scene, const Progress& progress);

/// The picture of that light.
Image light_image(const Scene& scene, const Film& irradiance);

/// @throw Cancelled; std::runtime_error.
Render render(const Scene& scene, const Progress& progress);

}  // namespace tensorray
