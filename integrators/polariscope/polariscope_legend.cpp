#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "integrators/polariscope/load_polariscope.h"
#include "renderer/charts/annotations.h"
#include "renderer/charts/color_bar.h"

namespace tensorray {
<<<<<<< HEAD
=======
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double cross_radius = 0.05;  // Of the picture's shorter side, ...
constexpr double cross_place = 0.1;    // ... and its distance from the upper right corner.

/// Draws a line through a point, and a letter at its end. @param angle  From u towards w, degrees.
void draw_mark(Image& image, const Vector2d& center, double radius, double angle, const std::string& letter) {
  const Vector2d along(std::cos(angle * pi / 180), -std::sin(angle * pi / 180));
  const double height = letter_height(image.width, image.height), width = std::max(1.0, radius / 16);
  const Vector2d end = center + (radius + height) * along;
  const Vector2d lower_left = end + Vector2d(-text_width(letter, height) / 2, height / 2);
  const Eigen::AlignedBox2d ground(center - Vector2d::Constant(1.5 * radius),
                                   center + Vector2d::Constant(1.5 * radius));
  const bool light = is_light(image, ground);
  const Vector3d ink = Vector3d::Constant(light ? 0 : 1), edge = Vector3d::Constant(light ? 1 : 0);
  for (const bool is_edge : {true, false}) {
    draw_stroke(image, center - radius * along, center + radius * along, is_edge ? 3 * width : width,
                is_edge ? edge : ink);
    draw_text(image, lower_left, height, letter, is_edge ? edge : ink, is_edge ? width : 0);
  }
}

void draw_cross(Image& image, const Arrangement& arrangement) {
  const double side = std::min(image.width, image.height);
  const Vector2d center(image.width - cross_place * side, cross_place * side);
  const Element* const first = first_polarizer(arrangement.before);
  const Element* const last = last_polarizer(arrangement.after);
  if (first) draw_mark(image, center, cross_radius * side, first->angle, "P");
  if (last) draw_mark(image, center, cross_radius * side, last->angle, "A");
}

}  // namespace
>>>>>>> ccc9ac2a589940ffbb29261ea0f004f96d66b2bc

std::function<void(Image&, double)> polariscope_legend(const Scene& scene, const LoadedLightOfPolariscope& loaded,
                                                       double greatest) {
  std::vector<MeanLight> analyses;
  std::vector<double> relative;
  for (const Band& band : loaded.light.bands) {
    analyses.push_back(analyses_of(loaded.arrangement, band.wavelength)[0]);
    relative.push_back(loaded.light.relative(band.wavelength));
  }
  const auto& [before, after] = loaded.arrangement;
  const auto is_retarder = [](const Element& element) { return element.kind == ElementKind::retarder; };
  const bool has_sign =
      std::any_of(before.begin(), before.end(), is_retarder) || std::any_of(after.begin(), after.end(), is_retarder);
  const Element* const first = first_polarizer(before);
  const Element* const last = last_polarizer(after);
  std::vector<std::pair<std::string, double>> directions;
  if (first) directions.emplace_back("P", first->angle);
  if (last) directions.emplace_back("A", last->angle);
  const double twice = ((first ? first->angle : 0) + 45) * pi / 90;
  const Eigen::Vector2d axis(std::cos(twice), std::sin(twice));  // The slow one.
  const ValueRange range{has_sign ? -greatest : 0, greatest};
  const auto color = [=, colors = band_colors(scene), wavelength = loaded.wavelength](double position) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < analyses.size(); ++k) {
      const double half = pi * range.value(position) / wavelength * relative[k];
      const Eigen::Quaterniond plate(std::cos(half), std::sin(half) * axis.x(), std::sin(half) * axis.y(), 0);
      sum += analyses[k].dot(light_of(plate)) * colors.col(static_cast<Eigen::Index>(k));
    }
    return sum;
  };
  return [=](Image& image, double exposure) {
    const double gain = std::exp2(exposure);
<<<<<<< HEAD
    draw_color_bar(image, {"nm", range, [&](double position) -> Eigen::Vector3d { return gain * color(position); }});
    draw_directions(image, directions);
=======
    draw_color_bar(image,
                   {"retardance\nnm", range, [&](double position) -> Vector3d { return gain * color(position); }});
    draw_cross(image, arrangement);
>>>>>>> ccc9ac2a589940ffbb29261ea0f004f96d66b2bc
  };
}

}  // namespace tensorray
