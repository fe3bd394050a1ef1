#include "renderer/charts/ink.h"

#include <cmath>
#include <stdexcept>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

/// Middle grey is 0.5 in display-referred and about 0.2 in scene-linear pictures; this suits both.
constexpr double light_brightness = 0.35;

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

Eigen::AlignedBox2i pixels_within(const Image& image, const Eigen::AlignedBox2d& box) {
  const Eigen::Vector2d size(image.width, image.height);
  const auto within = [&](const Eigen::Vector2d& p) { return p.cwiseMax(0).cwiseMin(size).eval(); };
  return {within(box.min()).array().floor().cast<int>().matrix(),
          (within(box.max()).array().ceil() - 1).cast<int>().matrix()};
}

void fill_box(Image& image, const Eigen::AlignedBox2d& box, const Eigen::Vector3d& color, double opacity) {
  for_each_pixel(image, box, [&](int x, int y, double coverage) { lay_over(image, x, y, color, opacity * coverage); });
}

void draw_stroke(Image& image, const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width,
                 const Eigen::Vector3d& color) {
  const Eigen::Vector2d along = to - from, margin = Eigen::Vector2d::Constant(width / 2 + 1);
  const double length = along.squaredNorm();
  const Eigen::AlignedBox2d box(from.cwiseMin(to) - margin, from.cwiseMax(to) + margin);
  for_each_pixel(image, box, [&](int x, int y, double) {
    const Eigen::Vector2d offset = Eigen::Vector2d(x + 0.5, y + 0.5) - from;
    const double part = length > 0 ? std::clamp(offset.dot(along) / length, 0.0, 1.0) : 0.0;
    lay_over(image, x, y, color, line_coverage((offset - part * along).norm(), width));
  });
}

bool is_light(const Image& image, const Eigen::AlignedBox2d& box) {
  double sum = 0, weight = 0;
  for_each_pixel(image, box, [&](int x, int y, double coverage) {
    const float* const p = image.pixel(x, y);
    const double brightness = 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
    if (!std::isfinite(brightness)) return;
    sum += coverage * std::clamp(brightness, 0.0, 1.0);
    weight += coverage;
  });
  return sum > light_brightness * weight;
}

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
