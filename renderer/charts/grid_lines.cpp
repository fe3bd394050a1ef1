#include "renderer/charts/grid_lines.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>

#include "renderer/charts/ink.h"

namespace tensorray {
namespace {

// Distances between lines, in pixels, at which lines are invisible and fully visible.
constexpr double densest = 3, sparse = 6;
// Gradients, relative to an undistorted picture, at which lines are invisible and fully visible.
constexpr double flat = 1e-3, sloped = 2e-3;

double smooth_step(double from, double to, double value) {
  const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Coverage by the lines of one coordinate. The distance to a line is taken to first order, |Δs| / |∇s|. On a fold,
/// where s changes with the square of the distance, a line is therefore up to twice as wide.
/// @param size  Number of pixels over which an undistorted coordinate goes from 0 to 1.
double coverage(double coordinate, double gradient, int cells, double width, int size) {
  if (!(gradient * size > flat) || !(gradient * cells * densest < 1)) return 0;
  const double nearest = std::clamp(std::round(coordinate * cells), 0.0, static_cast<double>(cells)) / cells;
  return line_coverage(std::abs(coordinate - nearest) / gradient, width) * smooth_step(flat, sloped, gradient * size) *
         smooth_step(densest, sparse, 1 / (gradient * cells));
}

double coverage(const PixelCoordinates& seen, const GridLines& lines, const Eigen::Vector2i& size) {
  if (!seen.valid || !seen.st.allFinite() || !seen.per_pixel.allFinite()) return 0;
  double free = 1;
  for (int i = 0; i < 2; ++i)
    free *= 1 - coverage(seen.st[i], seen.per_pixel.row(i).norm(), lines.cells[i], lines.width, size[i]);
  return 1 - free;
}

void check(const Image& image, const std::vector<PixelCoordinates>& coordinates, const GridLines& lines) {
  if (!begins_with_rgb(image))
    throw std::invalid_argument("grid lines need a picture that begins with channels R, G, B");
  if (coordinates.size() != static_cast<std::size_t>(image.width) * image.height)
    throw std::invalid_argument("grid lines need as many coordinates as the picture has pixels");
  if (lines.cells.minCoeff() < 1) throw std::invalid_argument("grid lines need at least one cell each way");
  if (!(lines.width >= 0) || !std::isfinite(lines.width))
    throw std::invalid_argument("the width of grid lines must be finite and not negative");
  if (!(lines.opacity >= 0 && lines.opacity <= 1))
    throw std::invalid_argument("the opacity of grid lines must be from 0 to 1");
}

}  // namespace

void draw_grid_lines(Image& image, const std::vector<PixelCoordinates>& coordinates, const GridLines& lines) {
  check(image, coordinates, lines);
  const Eigen::Vector2i size(image.width, image.height);
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const PixelCoordinates& seen = coordinates[static_cast<std::size_t>(y) * image.width + x];
      lay_over(image, x, y, lines.color, lines.opacity * coverage(seen, lines, size));
    }
  });
}

}  // namespace tensorray
