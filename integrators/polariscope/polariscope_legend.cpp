#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "integrators/polariscope/load_polariscope.h"
#include "renderer/charts/annotations.h"
#include "renderer/charts/color_bar.h"

namespace tensorray {

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
    draw_color_bar(
        image, {"retardance\nnm", range, [&](double position) -> Eigen::Vector3d { return gain * color(position); }});
    draw_directions(image, directions);
  };
}

}  // namespace tensorray
