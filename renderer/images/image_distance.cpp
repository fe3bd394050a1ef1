#include "renderer/images/image_distance.h"

#include <cmath>
#include <stdexcept>

namespace tensorray {

double relative_distance(const Image& image, const Image& exact) {
  if (image.width != exact.width || image.pixels.size() != exact.pixels.size())
    throw std::invalid_argument("pictures of different sizes have no distance");
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
    const double value = exact.pixels[i], difference = image.pixels[i] - value;
    squares += difference * difference;
    all += value * value;
  }
  return all > 0 ? std::sqrt(squares / all) : 0;
}

}  // namespace tensorray
