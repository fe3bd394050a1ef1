#include "renderer/charts/ink.h"

#include <cmath>
#include <cstddef>

namespace tensorray {
namespace {

/// Middle grey is 0.5 in display-referred and about 0.2 in scene-linear pictures; this suits both.
constexpr double light_brightness = 0.35;

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

}  // namespace tensorray
