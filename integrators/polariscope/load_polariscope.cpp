#include "integrators/polariscope/load_polariscope.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "base/constants.h"
#include "renderer/charts/annotations.h"
#include "renderer/charts/color_bar.h"
#include "scenes/scene/kept_results.h"

namespace tensorray {
namespace {

constexpr double auto_orders = 4;   // That 99 of 100 rays do not exceed.
constexpr int probe_pixels = 64;    // Along the longer side of the silhouette.
constexpr double nanometre = 1e-9;  // m.

/// The coefficients of a file, which must cover the light. @throw std::runtime_error.
Spectrum read_coefficients(const std::filesystem::path& file, const LightDescription& light, double reference) {
  Spectrum table = read_spectrum(file, true);
  const double first = table.wavelengths.front(), last = table.wavelengths.back();
  if (first > light.wavelength_min || last < light.wavelength_max)
    throw std::runtime_error(
        fmt::format("{}: its coefficients, from {:g} to {:g} nm, do not cover the light, from {:g} to {:g} nm; add "
                    "lines, or narrow `/light/wavelengths`",
                    file.string(), first, last, light.wavelength_min, light.wavelength_max));
  if (table.at(reference) == 0)
    throw std::runtime_error(fmt::format("{}: the coefficient at {:g} nm must not be 0", file.string(), reference));
  return table;
}

/// The integral of the secondary principal difference that 99 of 100 rays through the field do not exceed.
double greatest_integral(const Scene& scene, PolarizedLight light) {
  const Surfaces& surfaces = scene.geometry.surfaces();
  const Geometry volume({surfaces.bounds, surfaces.cut, std::nullopt, surfaces.obstacles});
  const Beam beam = silhouette_beam(scene.field.corners(), light.direction, light.up);
  const auto [near, far] = depth_range(scene.field, beam.center, beam.direction);
  light.bands.clear();
  light.aperture.reset();
  light.strength = 1 / (scene.field.max_norm() * (far - near));  // Any units: phases are about 1.
  light.samples = 1;
  const Plate plate = plate_across(beam, far, probe_pixels);
  const PolarTracer tracer(scene.field, volume, light, plate);
  std::vector<LightRow> rows(static_cast<std::size_t>(plate.resolution.y()));
  tbb::parallel_for(std::size_t(0), rows.size(), [&](std::size_t y) { rows[y] = tracer.row(static_cast<int>(y)); });
  std::vector<float> integrals;
  for (const LightRow& row : rows)
    for (const PolarPoint& point : row.points)
      if (point.length > 0) integrals.push_back(static_cast<float>(point.integral / 2));
  return greatest_of_most(integrals) / light.strength;
}

double choose_coefficient(const Scene& scene, const PolarizedLight& light, double unit_length, double wavelength,
                          std::vector<std::string>& notes) {
  const Eigen::Vector3d& V = light.direction;
  std::string key =
      fmt::format("stress_optic {} {} {} {} {}", V.x(), V.y(), V.z(), unit_length, scene.geometry.has_cut());
  for (const TriangleMesh& obstacle : scene.geometry.surfaces().obstacles)
    key += fmt::format(" {} {} {}", obstacle.triangles.size(), obstacle.bounds().min().norm(),
                       obstacle.bounds().max().norm());
  std::shared_ptr<const double> known = scene.kept ? scene.kept->find<double>(key) : nullptr;
  const double integral = known ? *known : scene.field.max_norm() > 0 ? greatest_integral(scene, light) : 0;
  if (scene.kept && !known) scene.kept->keep(key, integral, sizeof integral);
  if (!(integral > 0)) {
    notes.push_back(
        "warning: the field turns no polarisation (across the light, its principal values are equal, or light misses "
        "the volume); stress_optic 1");
    return 1;
  }
  // As it is printed, so that a scene can have the same.
  const double chosen =
      Json::parse(fmt::format("{:.6g}", auto_orders * wavelength * nanometre / (unit_length * integral)));
  notes.push_back(
      fmt::format("stress_optic: {:g} (99 of 100 rays through the field have {:g} orders or fewer at {:g} "
                  "nm); give that of the material to compare with a photograph",
                  chosen, auto_orders, wavelength));
  return chosen;
}

}  // namespace

Eigen::Matrix3Xd band_colors(const Scene& scene) {
  Eigen::Matrix3Xd xyz(3, scene.bands.size());
  for (std::size_t k = 0; k < scene.bands.size(); ++k) xyz.col(static_cast<Eigen::Index>(k)) = scene.bands[k].xyz;
  return to_working(scene) * xyz;
}

double greatest_of_most(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto high = values.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), high, values.end());
  return *high;
}

LoadedLightOfPolariscope load_polariscope(const Scene& scene, const PolariscopeDescription& settings,
                                          std::vector<std::string>& notes) {
  LoadedLightOfPolariscope loaded;
  PolarizedLight& light = loaded.light;
  const Plate& plate = *scene.geometry.surfaces().plate;
  light.direction = scene.beam.direction;
  light.up = upright(light.direction, plate.up);
  light.right = light.direction.cross(light.up);
  light.start = scene.beam.center;
  light.bands = scene.bands;
  if (scene.description.light.wavelength_min == scene.description.light.wavelength_max) light.bands.front().width = 0;
  light.reference = reference_channel(scene);
  light.samples = settings.samples.value_or(2);
  const FieldUnits units = units_of(scene);
  const double unit_length = settings.unit_length.value_or(metres_in(units.length));
  const double wavelength = loaded.wavelength = light.bands[light.reference].wavelength;
  if (scene.description.light.aperture) {
    light.aperture.emplace();
    for (const Eigen::Vector2d& corner : scene.beam.aperture) light.aperture->extend(corner);
    light.aperture_axes << scene.beam.right.transpose(), scene.beam.up.transpose();
  }
  light.relative = [wavelength](double other) { return wavelength / other; };
  if (const auto* file = std::get_if<std::filesystem::path>(&settings.stress_optic)) {
    const Spectrum table = read_coefficients(*file, scene.description.light, wavelength);
    loaded.stress_optic = table.at(wavelength);
    light.relative = [table, wavelength, at_reference = loaded.stress_optic](double other) {
      const double inside = std::clamp(other, table.wavelengths.front(), table.wavelengths.back());
      return table.at(inside) / at_reference * wavelength / other;
    };
  } else if (const auto* number = std::get_if<double>(&settings.stress_optic)) {
    loaded.stress_optic = *number;
  } else {
    loaded.stress_optic = choose_coefficient(scene, light, unit_length, wavelength, notes);
  }
  light.strength = pi * loaded.stress_optic * unit_length / (wavelength * nanometre);
  if (!std::isfinite(static_cast<float>(light.strength * scene.field.max_norm())))
    throw std::runtime_error("`/integrator/stress_optic` times the field is beyond single precision; check its units");
  loaded.order_note = fmt::format("1 order: {:g} nm", wavelength);
  if (!units.tensor.empty() && !units.length.empty())
    loaded.order_note +=
        fmt::format(", {:.3g} {} {}", wavelength * nanometre / std::abs(loaded.stress_optic * unit_length),
                    units.tensor, units.length);
  loaded.arrangement = turned(settings.arrangement, settings.angle, settings.analyzer);
  return loaded;
}

std::function<void(Image&, double)> polariscope_legend(const Scene& scene, const LoadedLightOfPolariscope& loaded,
                                                       double greatest) {
  std::vector<MeanLight> analyses;
  for (const Band& band : loaded.light.bands) analyses.push_back(analyses_of(loaded.arrangement, band.wavelength)[0]);
  const auto& [before, after] = loaded.arrangement;
  const auto is_retarder = [](const Element& element) { return element.kind == ElementKind::retarder; };
  const bool has_sign =
      std::any_of(before.begin(), before.end(), is_retarder) || std::any_of(after.begin(), after.end(), is_retarder);
  const Element *const polarizer = last_polarizer(before), *const analyzer = last_polarizer(after);
  std::vector<std::pair<std::string, double>> directions;
  if (polarizer) directions.emplace_back("P", polarizer->angle);
  if (analyzer) directions.emplace_back("A", analyzer->angle);
  const double twice = ((polarizer ? polarizer->angle : 0) + 45) * pi / 90;
  const Eigen::Vector2d axis(std::cos(twice), std::sin(twice));  // The slow one.
  const ValueRange range{has_sign ? -greatest : 0, greatest};
  const auto color = [=, colors = band_colors(scene)](double position) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < analyses.size(); ++k) {
      const double relative = loaded.light.relative(loaded.light.bands[k].wavelength);
      const double half = pi * range.value(position) / loaded.wavelength * relative;
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
