#include "scenes/scene/fine_bands.h"

namespace tensorray {

LightRange light_range(const Scene& scene) {
  const BendingDescription& bending = scene.description.bending;
  const LightDescription& light = scene.description.light;
  if (bending.rgb) return {{bending.rgb->x(), bending.rgb->y(), bending.rgb->z()}, false};
  return {{bending.flexibility.at(light.wavelength_min), bending.flexibility.at(light.wavelength_max)}, true};
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
