#include "renderer/images/image_distance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tensorray {

double relative_distance(const Image& image, const Image& exact) {
  const std::size_t channels = exact.channels.size(), colors = std::min<std::size_t>(channels, 3);
  if (image.width != exact.width || image.height != exact.height || image.channels.size() != channels)
    throw std::invalid_argument("pictures of different sizes or channels have no distance");
  double difference = 0, all = 0;
  for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
    if (i % channels >= colors) continue;
    difference += std::pow(static_cast<double>(image.pixels[i]) - exact.pixels[i], 2);
    all += std::pow(static_cast<double>(exact.pixels[i]), 2);
  }
  return all > 0 ? std::sqrt(difference / all) : 0;
}

}  // namespace tensorray
