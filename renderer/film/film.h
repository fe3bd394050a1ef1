#pragma once
/// @file renderer/film/film.h
/// Light collected by the pixels of a plate. Each channel is a wavelength band (or a colour, in RGB mode).

#include <cstddef>
#include <vector>

namespace tensorray {

/// Channels are planes: channel c, row y (from the top), column x at [(c * height + y) * width + x].
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

}  // namespace tensorray
