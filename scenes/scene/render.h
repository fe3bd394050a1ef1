#pragma once
/// @file scenes/scene/render.h
/// What a method made of a scene, ready to be written.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "integrators/bending/light_channel.h"
#include "integrators/paths/paths.h"
#include "renderer/film/photon_map.h"
#include "renderer/film/spectral_image.h"
#include "renderer/images/image.h"
#include "volumes/grids/scalar_grid.h"

namespace tensorray {

struct Progress;
struct Scene;

struct Statistics {
  std::uint64_t positions = 0;  ///< From which light was emitted.
  std::vector<EndCounts> ends;  ///< Rays by channel and end.
  std::vector<double>
      channel_power;  ///< Of one ray, by channel, the beam's irradiance being 1; empty if rays carry none.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  double seconds_tracing = 0, seconds_density = 0, seconds_drawing = 0, seconds_color = 0;
};

/// Whether no ray of any channel ended where it counts, so that a picture shows nothing.
bool nothing_arrived(const Statistics& statistics);

struct Render {
  Image linear;  ///< R, G, B in the scene-linear working space (1 is the undisturbed light, or the image's white); then
                 ///< A, multiplied in, and other channels, if the method has them.
  std::optional<Image> display;           ///< The picture as a display shows it, if not to be made of `linear`.
  std::optional<SpectralImage> spectral;  ///< If the scene asks for it.
  PhotonMap photons;                      ///< If the scene asks for it.
  std::vector<ScalarGrid> grids;          ///< Of a method that makes a volume, if the scene asks for it.
  std::vector<Path> paths;                ///< Of path tracing.
  std::optional<double> exposure;         ///< Stops at which it is well shown; none: by its brightness.
  ImageMetadata metadata;                 ///< What the method has to say of its files, for their headers.
  /// Writes the tubes about `paths`; empty unless the scene asks for them.
  std::function<void(const std::filesystem::path&, const std::vector<Path>& paths)> write_tubes;
  std::function<void(Image&)> annotate;  ///< Draws a legend over a scene-linear picture; empty: there is none.
  Statistics statistics;
  std::vector<std::string> warnings;  ///< What a picture does not show of itself, a line each.
};

/// Renders the scene by its method. @throw Cancelled; std::runtime_error; SceneError.
Render render(const Scene& scene, const Progress& progress);

}  // namespace tensorray
