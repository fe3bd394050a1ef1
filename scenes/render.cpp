#include "scenes/render.h"

#include <chrono>
#include <set>

#include <fmt/format.h>

#include "scenes/render_lens.h"
#include "scenes/render_paths.h"

namespace tensorray {
namespace {

constexpr double narrowest_white = 100;  // nm: light of a smaller range is seen as a colour.

/// Whether light is collected in colour: three bands need no more planes, and cost less.
bool is_collected_in_color(const Scene& scene) {
  return scene.description.output.spectral.empty() && scene.bands.size() > 3;
}

/// "550nm", with as many decimals as tell the bands apart; in RGB mode "red", "green", "blue".
std::vector<std::string> band_names(const Scene& scene) {
  if (scene.description.bending.rgb) return {"red", "green", "blue"};
  constexpr int most_decimals = 9;
  for (int decimals = 0;; ++decimals) {
    std::vector<std::string> names;
    for (const Band& band : scene.bands) names.push_back(fmt::format("{:.{}f}nm", band.wavelength, decimals));
    if (decimals == most_decimals || std::set<std::string>(names.begin(), names.end()).size() == names.size())
      return names;
  }
}

void name_fluence(const Scene& scene, std::vector<ScalarGrid>& grids) {
  if (grids.empty()) return;
  grids[0].name = "fluence";
  grids[0].metadata["tensorray:units"] = "irradiance of the undisturbed beam";
  if (grids.size() == 1) return;
  const std::vector<std::string> names = band_names(scene);
  for (std::size_t i = 0; i < names.size(); ++i) {
    ScalarGrid& grid = grids[i + 1];
    grid.name = "fluence_" + names[i];
    grid.metadata["tensorray:units"] = "irradiance of the undisturbed beam in this band";
    grid.metadata["tensorray:power"] = fmt::format("{}", scene.bands[i].power);
    if (!scene.description.bending.rgb)
      grid.metadata["tensorray:wavelength"] = fmt::format("{} nm", scene.bands[i].wavelength);
  }
}

Render render_photons(const Scene& scene, const Progress& progress) {
  const SceneDescription& description = scene.description;
  PhotonDistribution light = distribute_photons(scene, progress);

  const auto start = std::chrono::steady_clock::now();
  Render result;
  result.linear = light_image(scene, light.irradiance);
  if (!description.output.spectral.empty())
    result.spectral = spectral_image(light.irradiance, scene.bands, description.light.irradiance, to_working(scene));
  result.photons = std::move(light.photons);
  result.fluence = std::move(light.fluence);
  name_fluence(scene, result.fluence);
  result.metadata["tensorray:photons"] = std::to_string(light.positions);

  Statistics& statistics = result.statistics;
  statistics.positions = light.positions;
  statistics.ends = std::move(light.ends);
  for (const LightChannel& channel : scene.channels) statistics.channel_power.push_back(channel.power * light.ray_area);
  statistics.ray_steps = light.ray_steps;
  statistics.tensor_samples = light.tensor_samples;
  statistics.seconds_tracing = light.seconds_tracing;
  statistics.seconds_density = light.seconds_density;
  statistics.seconds_color = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace

PhotonDistribution distribute_photons(const Scene& scene, const Progress& progress) {
  const SceneDescription& description = scene.description;
  PhotonSettings settings;
  settings.photons = description.light.photons;
  settings.pattern = description.light.pattern;
  settings.channels_per_photon = description.bending.rgb ? 0 : description.light.wavelengths_per_photon;
  settings.seed = description.seed;
  settings.density = description.integrator.density;
  settings.keep_photons = !description.output.photons.empty();
  if (!description.output.fluence.empty())
    settings.fluence = description.output.fluence_bands ? FluenceKind::bands : FluenceKind::all_light;
  if (is_collected_in_color(scene))
    for (const Band& band : scene.bands) settings.colors.push_back(to_working(scene) * band.xyz);
  return distribute_photons(scene.field, scene.geometry, scene.beam, scene.channels, scene.bending, settings, progress);
}

Image light_image(const Scene& scene, const Film& irradiance) {
  if (!is_collected_in_color(scene)) return linear_image(irradiance, scene.bands, to_working(scene));
  std::vector<Band> primaries(3);
  for (int c = 0; c < 3; ++c) primaries[c].xyz = Eigen::Vector3d::Unit(c);
  return linear_image(irradiance, primaries, Eigen::Matrix3d::Identity());
}

bool has_white(const Scene& scene) {
  double width = 0;
  for (const Band& band : scene.bands) width += band.width;
  return scene.description.bending.rgb || width >= narrowest_white;
}

Eigen::Matrix3d to_working(const Scene& scene) {
  if (!scene.description.output.white_balance || !has_white(scene)) return scene.color.xyz_to_working();
  Eigen::Vector3d white = Eigen::Vector3d::Zero();
  for (const Band& band : scene.bands) white += band.xyz;
  return scene.color.xyz_to_working_adapted(white);
}

Render render(const Scene& scene, const Progress& progress) {
  switch (scene.description.integrator.type) {
    case IntegratorType::photon_distribution:
      return render_photons(scene, progress);
    case IntegratorType::lens:
      return render_lens(scene, progress);
    case IntegratorType::path_tracing:
      return render_paths(scene, progress);
  }
  throw std::logic_error("unknown integrator");
}

}  // namespace tensorray
