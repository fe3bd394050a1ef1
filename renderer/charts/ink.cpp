#include "renderer/charts/ink.h"

#include <algorithm>
#include <cstddef>

namespace tensorray {

double line_coverage(double distance, double width) {
  return std::max(std::min(distance + 0.5, width / 2) - std::max(distance - 0.5, -width / 2), 0.0);
}

void lay_over(Image& image, int x, int y, const Eigen::Vector3d& color, double coverage) {
  if (coverage == 0) return;
  float* const pixel = image.pixel(x, y);
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const bool alpha = image.channels[c] == "A";
    if (alpha || c < 3)
      pixel[c] += static_cast<float>(coverage) * (static_cast<float>(alpha ? 1 : color[c]) - pixel[c]);
  }
}

}  // namespace tensorray
