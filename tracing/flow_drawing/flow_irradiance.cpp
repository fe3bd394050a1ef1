#include "tracing/flow_drawing/flow_irradiance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include "base/constants.h"
#include "base/process/job.h"
#include "renderer/coverage/area_deposit.h"
#include "renderer/lights/beam.h"
#include "tracing/flow/flow_map.h"
#include "tracing/flow/wavelength_tracer.h"
#include "tracing/flow_drawing/caustic.h"
#include "tracing/flow_drawing/flow_view.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int landing_probes = 96;          // Rays along each side of the aperture that find where light lands.
constexpr double landing_margin = 0.02;     // Of the part where light lands, on each side.
constexpr double landing_tolerance = 0.25;  // Pixels.

/// Direction `pass` of a disk: the points of a spiral, each with the same part of the disk (Vogel 1979).
Vector3d disk_direction(const LandingLight& light, int pass) {
  if (light.angle == 0 || light.passes == 1) return light.direction;
  const double golden = pi * (3 - std::sqrt(5.0));
  const double radius = std::sin(light.angle) * std::sqrt((pass + 0.5) / light.passes);
  const Vector3d up = upright(light.direction, Vector3d::UnitZ()), right = up.cross(light.direction);
  return (light.direction + radius * (std::cos(pass * golden) * right + std::sin(pass * golden) * up)).normalized();
}

/// The silhouette of the volume; light starts before all obstacles.
Beam beam_of(const TensorField& field, const Surfaces& surfaces, const Plate& plate, const LandingLight& light,
             int pass) {
  if (light.source) return point_beam(field.corners(), *light.source);
  const Vector3d direction = disk_direction(light, pass);
  Beam beam = silhouette_beam(field.corners(), direction, Vector3d::UnitZ());
  const auto start_before = [&](const std::vector<Vector3d>& points) {
    for (const Vector3d& point : points)
      beam.center += std::min(0.0, (point - beam.center).dot(direction) - 1e-3 * plate.size.norm()) * direction;
  };
  for (const TriangleMesh& mesh : surfaces.obstacles) start_before(mesh.vertices);
  if (surfaces.body) start_before(surfaces.body->vertices);
  return beam;
}

/// Whether straight light through the middle of the volume meets the plane of the plate before the volume. It would
/// have to turn back to land on the plate.
bool is_before(const Plate& plate, const TensorField& field, const LandingLight& light) {
  const Vector3d middle = field.world_box().center();
  const double height = plate.normal().dot(middle - plate.center);
  return height * plate.normal().dot(light.source ? Vector3d(middle - *light.source) : light.direction) > 0;
}

/// The box, in pixels of `plate`, in which light of the two ends of the spectrum lands.
Eigen::AlignedBox2d landing_box(const TensorField& field, const Geometry& geometry, const Plate& plate,
                                const Beam& beam, const BendingSettings& bending, const LandingLight& light) {
  Eigen::AlignedBox2d aperture, landings;
  for (const Vector2d& corner : beam.aperture) aperture.extend(corner);
  const auto whole = plate.resolution.cast<double>();
  for (int y = 0; y < landing_probes; ++y) {
    RayBatch rays;
    for (int x = 0; x < landing_probes; ++x) {
      const Vector2d at =
          aperture.min().array() + aperture.sizes().array() * Eigen::Array2d(x + 0.5, y + 0.5) / landing_probes;
      const Vector3d start = beam.start(at);
      for (const double flexibility : {light.flexibilities.front(), light.flexibilities.back()})
        rays.add(start, beam.direction_at(start), flexibility);
    }
    trace(field, geometry, bending, rays);
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (rays.end[i] == RayEnd::plate)
        landings.extend(
            Vector2d(plate.to_pixel(place_on(plate, geometry, beam, rays.position[i])).cwiseMax(0).cwiseMin(whole)));
  }
  return landings;
}

/// A part of a plate. @param box  In pixels of the plate.
Plate part_of(const Plate& plate, Eigen::AlignedBox2d box, int resolution) {
  const Vector2d whole = plate.resolution.cast<double>(), more = (landing_margin * box.sizes()).cwiseMax(1e-3 * whole);
  box = {(box.min() - more).cwiseMax(0), (box.max() + more).cwiseMin(whole)};
  Plate part = plate;
  part.center = plate.to_world(box.center());
  part.size = box.sizes().cwiseProduct(plate.pixel_size());
  part.resolution = (resolution * part.size / part.size.maxCoeff()).array().ceil().max(1).cast<int>();
  return part;
}

/// Adds to each pixel of a plate the part of it on which the beam's straight light lands, times `weight`.
/// @return false if it does not land, because it is along the plate or behind it.
bool add_straight(const Beam& beam, const Plate& plate, float weight, std::vector<float>& straight) {
  std::vector<Vector2d> outline;
  for (const Vector2d& corner : beam.aperture) {
    const Vector3d start = beam.start(corner), direction = beam.direction_at(start);
    const double way = plate.normal().dot(plate.center - start) / plate.normal().dot(direction);
    if (!(way > 0) || !std::isfinite(way)) return false;
    outline.push_back(plate.to_pixel(start + way * direction));
  }
  const int width = plate.resolution.x(), height = plate.resolution.y();
  const double unit = std::max(std::abs(area(outline)), double(width) * height);  // Pixels of the power 1.
  AreaDeposit deposit(width, height);
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    const Vector2d &a = outline[0], &b = outline[i], &c = outline[i + 1];
    const double density = deposit.triangle(a, b, c, std::abs(area({a, b, c})) / unit);
    deposit.add_edge(a, b, density);
    deposit.add_edge(b, c, density);
    deposit.add_edge(c, a, density);
  }
  deposit.flush();
  std::vector<double> row(static_cast<std::size_t>(width));
  straight.resize(row.size() * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    AreaDeposit::read_row({&deposit}, y, 0, row.data());
    for (std::size_t x = 0; x < row.size(); ++x)
      straight[static_cast<std::size_t>(y) * row.size() + x] +=
          weight * static_cast<float>(std::clamp(row[x] * unit, 0.0, 1.0));
  }
  return true;
}

/// For the flexibilities of the light, as a range if they differ.
FlowSettings flow_settings(const LandingLight& light, const Plate& plate, const FlowIrradianceSettings& wanted) {
  const auto [least, greatest] = std::minmax_element(light.flexibilities.begin(), light.flexibilities.end());
  FlowSettings settings;
  settings.range = *least < *greatest;
  settings.flexibilities = settings.range ? std::vector<double>{*least, *greatest} : std::vector<double>{*least};
  settings.plate = plate;
  settings.tolerance = landing_tolerance;
  settings.max_starts = wanted.rays;
  settings.job = wanted.job;
  return settings;
}

std::vector<CausticBand> bands_of(const LandingLight& light, const FlowMap& map, const FlowSettings& settings) {
  const double least = settings.flexibilities.front(), whole = settings.flexibilities.back() - least;
  const double last = static_cast<double>(map.wavelengths - 1);
  const auto sample_at = [&](double flexibility) { return settings.range ? last * (flexibility - least) / whole : 0; };
  std::vector<CausticBand> bands;
  for (std::size_t i = 0; i + 1 < light.flexibilities.size(); ++i) {
    const double a = sample_at(light.flexibilities[i]), b = sample_at(light.flexibilities[i + 1]);
    CausticBand band;
    band.sample = (a + b) / 2;
    band.width = std::abs(b - a);
    band.channel = i;
    bands.push_back(band);
  }
  return bands;
}

/// The number of sheets of the map at each pixel's middle, for light of the middle wavelength.
std::vector<float> sheets_of(const FlowMap& map, const Eigen::Vector2i& resolution) {
  FlowPicture picture;
  picture.resolution = resolution;
  const double place = static_cast<double>(map.wavelengths - 1) / 2;
  const FlowView view(map, picture, {FlowRange{place, place}}, 1);
  std::vector<float> sheets(static_cast<std::size_t>(resolution.x()) * static_cast<std::size_t>(resolution.y()));
  tbb::parallel_for(0, view.tiles(), [&](int tile) {
    std::vector<FlowPoint> points;
    view.draw(tile, 1, 0, place, {}, points);
    const Eigen::AlignedBox2i box = view.pixels(tile);
    auto point = points.begin();
    for (int y = box.min().y(); y <= box.max().y(); ++y) {
      float* const row = &sheets[static_cast<std::size_t>(y) * static_cast<std::size_t>(resolution.x())];
      for (int x = box.min().x(); x <= box.max().x(); ++x) row[x] = (point++)->sheets;
    }
  });
  return sheets;
}

}  // namespace

std::optional<FlowIrradiance> flow_irradiance(const TensorField& field, const Surfaces& surfaces, const Plate& plate,
                                              const LandingLight& light, const FlowIrradianceSettings& settings,
                                              const Progress& progress) {
  if (is_before(plate, field, light)) return std::nullopt;
  Surfaces parts = surfaces;
  if (!parts.body) parts.plate = plate;
  const Geometry geometry(std::move(parts));
  Eigen::AlignedBox2d box;
  for (int pass = 0; pass < light.passes; ++pass) {
    const Beam beam = beam_of(field, surfaces, plate, light, pass);
    box.extend(landing_box(field, geometry, plate, beam, settings.bending, light));
  }
  if (box.isEmpty()) return std::nullopt;
  FlowIrradiance result;
  result.plate = part_of(plate, box, settings.resolution);
  const FlowSettings tracing = flow_settings(light, result.plate, settings);
  const std::size_t channels = light.flexibilities.size() - 1;
  bool is_known = !surfaces.body || light.passes == 1;  // Before a body's plane, tilted light is elsewhere.
  for (int pass = 0; pass < light.passes; ++pass) {
    Film irradiance;  // Of this direction.
    const Beam beam = beam_of(field, surfaces, plate, light, pass);
    is_known = is_known && add_straight(beam, result.plate, 1.0f / static_cast<float>(light.passes), result.straight);
    const auto make = [&] {
      const FlowMap map = trace_flow_map(field, geometry, beam, settings.bending, tracing, progress);
      CausticSettings drawing;
      drawing.channels = channels;
      drawing.ranks = settings.job ? settings.job->ranks : nullptr;
      irradiance = draw_caustic(map, result.plate, bands_of(light, map, tracing), drawing, progress).irradiance;
      if (pass == 0) result.folds = sheets_of(map, result.plate.resolution);
    };
    const std::string name = fmt::format("{}map {} {}", light_name, settings.number, pass);
    find_or_make(settings.job, name, make, [&](Archive& archive) {
      const Eigen::Vector2i& resolution = result.plate.resolution;
      if (archive.reads()) irradiance = Film(resolution.x(), resolution.y(), static_cast<int>(channels));
      archive.copy(irradiance.values.data(), irradiance.values.size() * sizeof irradiance.values[0]);
      if (pass > 0) return;
      result.folds.resize(irradiance.plane_size());
      archive.copy(result.folds.data(), result.folds.size() * sizeof(float));
    });
    if (pass == 0) {
      result.irradiance = std::move(irradiance);
      continue;
    }
    for (std::size_t i = 0; i < result.irradiance.values.size(); ++i)
      result.irradiance.values[i] += irradiance.values[i];
  }
  for (double& value : result.irradiance.values) value /= light.passes;
  if (!is_known) result.straight.clear();
  return result;
}

}  // namespace tensorray
