#include "renderer/film/image_distance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tensorray {

double relative_distance(const Image& image, const Image& exact) {
  const std::size_t colors = std::min<std::size_t>(exact.channels.size(), 3);
  if (image.width != exact.width || image.height != exact.height ||
      std::min<std::size_t>(image.channels.size(), 3) != colors)
    throw std::invalid_argument("pictures of different sizes or numbers of colours have no distance");
  double squares = 0, all = 0;
  for (int y = 0; y < exact.height; ++y)
    for (int x = 0; x < exact.width; ++x)
      for (std::size_t c = 0; c < colors; ++c) {
        const double value = exact.pixel(x, y)[c], difference = image.pixel(x, y)[c] - value;
        squares += difference * difference;
        all += value * value;
      }
  return all > 0 ? std::sqrt(squares / all) : 0;
}

}  // namespace tensorray
