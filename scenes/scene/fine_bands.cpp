#include <algorithm>
#include <cmath>

#include "scenes/scene/scene.h"

namespace tensorray {

LightRange light_range(const Scene& scene) {
  const BendingDescription& bending = scene.description.bending;
  const LightDescription& light = scene.description.light;
  if (bending.rgb) return {{bending.rgb->x(), bending.rgb->y(), bending.rgb->z()}, false};
  return {{bending.flexibility.at(light.wavelength_min), bending.flexibility.at(light.wavelength_max)}, true};
}

std::size_t reference_channel(const Scene& scene) {
  if (scene.description.bending.rgb) return 1;
  constexpr double wavelength = 550;
  const auto nearest = std::min_element(scene.bands.begin(), scene.bands.end(), [](const Band& a, const Band& b) {
    return std::abs(a.wavelength - wavelength) < std::abs(b.wavelength - wavelength);
  });
  return static_cast<std::size_t>(nearest - scene.bands.begin());
}

double reference_place(const Scene& scene) {
  const auto channel = static_cast<double>(reference_channel(scene));
  return scene.description.bending.rgb ? channel / 2 : (channel + 0.5) / static_cast<double>(scene.bands.size());
}

std::vector<FineBand> fine_bands(const Scene& scene, int count) {
  std::vector<FineBand> bands;
  if (scene.description.bending.rgb) {
    const double last = static_cast<double>(scene.bands.size() - 1);
    for (std::size_t k = 0; k < scene.bands.size(); ++k) {
      const double place = static_cast<double>(k) / last;
      bands.push_back({scene.bands[k], place, place, k, 1});
    }
    return bands;
  }
  const LightDescription& light = scene.description.light;
  const std::vector<Band> fine = make_bands(scene.spectrum, light.wavelength_min, light.wavelength_max, count);
  const std::size_t parts = fine.size() / scene.bands.size();
  for (std::size_t i = 0; i < fine.size(); ++i) {
    const std::size_t channel = i / parts;
    const double power = scene.bands[channel].power;
    bands.push_back({fine[i], static_cast<double>(i) / count, static_cast<double>(i + 1) / count, channel,
                     power > 0 ? fine[i].power / power : 0});
  }
  return bands;
}

}  // namespace tensorray
