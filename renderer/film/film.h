#pragma once
/// Light that a plate collects, by pixels or as photons.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Light by pixels. Each channel is a wavelength band (or a colour, in RGB mode). Channels are planes: channel c, row y
/// (from the top), column x at [(c * height + y) * width + x].
struct Film {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<double> values;

  Film() = default;
  Film(int width_, int height_, int channels_)
      : width(width_),
        height(height_),
        channels(channels_),
        values(static_cast<std::size_t>(width_) * height_ * channels_) {}

  std::size_t plane_size() const { return static_cast<std::size_t>(width) * height; }
  double* plane(int channel) { return values.data() + plane_size() * channel; }
  const double* plane(int channel) const { return values.data() + plane_size() * channel; }
};

/// A photon where it reached the plate. Single precision: seven digits of world coordinates.
struct PlatePhoton {
  Eigen::Vector3f position;   ///< Landing, world.
  Eigen::Vector3f direction;  ///< Unit direction at the landing, world.
  Eigen::Vector3f origin;     ///< Where the ray was emitted, world.
  float wavelength = 0;       ///< nm; 0 in RGB mode.
  float power = 0;            ///< In units of the irradiance of the light times area.
};

}  // namespace tensorray
