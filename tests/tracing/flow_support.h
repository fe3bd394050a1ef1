#pragma once
/// Flow maps of fields in a cube, and their light.

#include <numeric>
#include <utility>

#include "tests/tracing/support.h"
#include "tracing/flow/flow_map.h"
#include "tracing/flow_drawing/caustic.h"

namespace tensorray::test {

/// A volume in parallel light, and a plate.
struct LightBench {
  TensorField field;
  Geometry geometry;
  Beam beam;

  const Plate& plate() const { return *geometry.surfaces().plate; }
};

inline LightBench make_bench(TensorField field, const Plate& plate, Surfaces extra = {},
                             const Vector3d& direction = {0, 0, -1}) {
  extra.bounds = surfaces_of(field).bounds;
  extra.plate = plate;
  Beam beam = silhouette_beam(field.corners(), direction.normalized(), Vector3d::UnitY());
  return {std::move(field), Geometry(std::move(extra)), std::move(beam)};
}

inline LightBench make_bench(const TensorFunction& tensor, const Plate& plate, Surfaces extra = {}, int voxels = 17) {
  return make_bench(cube_field(voxels, tensor), plate, std::move(extra));
}

inline Plate plate_at(double distance, double size, int resolution) {
  Plate plate = plate_across({0, 0, -1}, distance);
  plate.size = {size, size};
  plate.resolution = {resolution, resolution};
  return plate;
}

/// `count` bands of equal widths and weights between two samples.
inline std::vector<CausticBand> equal_bands(std::size_t count, double first, double last) {
  std::vector<CausticBand> bands(count);
  for (std::size_t i = 0; i < count; ++i) {
    bands[i].width = (last - first) / static_cast<double>(count);
    bands[i].sample = first + (static_cast<double>(i) + 0.5) * bands[i].width;
    bands[i].weight = 1.0 / static_cast<double>(count);
  }
  return bands;
}

inline Matrix3d zero(const Vector3d&) { return Matrix3d::Zero(); }

/// Turns light along z sideways.
inline Matrix3d sideways(const Vector2d& turn) {
  Matrix3d tensor = Matrix3d::Zero();
  tensor.col(2).head<2>() = turn;
  tensor.row(2).head<2>() = turn;
  return tensor;
}

/// A field that focuses light of positive flexibility in the middle, and folds it further out.
inline Matrix3d lens(const Vector3d& at) {
  return sideways(-2 * std::exp(-3 * at.head<2>().squaredNorm()) * at.head<2>());
}

/// A map that is given, over a lattice of `count` × `count` quads of the square from (low, low) to (high, high).
/// Lengths are the starts' x.
template <class Map>
FlowMap lattice_map(int count, double low, double high, const Map& landing) {
  FlowMap map;
  const double side = (high - low) / count;
  for (int y = 0; y <= count; ++y)
    for (int x = 0; x <= count; ++x) {
      map.starts.emplace_back(low + x * side, low + y * side);
      map.landings.push_back(Vector2d(landing(map.starts.back())).cast<float>());
      map.lengths.push_back(static_cast<float>(map.starts.back().x()));
    }
  map.ends.assign(map.starts.size(), RayEnd::plate);
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto triangle = static_cast<std::uint32_t>(map.triangles.size());
    map.triangles.push_back({{a, b, c}, side * side / 2, 0, false});
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
      map.edges.push_back({from, to, triangle});
  };
  const auto up = static_cast<std::uint32_t>(count + 1);
  for (std::uint32_t y = 0; y + 1 < up; ++y)
    for (std::uint32_t a = y * up; a + 1 < (y + 1) * up; ++a) {
      add(a, a + 1, a + up + 1);
      add(a, a + up + 1, a + up);
    }
  return map;
}

/// Gives a map of one wavelength `samples` of them, which all land. @param moves  By how much, from a start and a
/// sample.
template <class Moves>
void spread(FlowMap& map, std::size_t samples, const Moves& moves) {
  std::vector<Eigen::Vector2f> landings;
  for (std::size_t i = 0; i < map.starts.size(); ++i)
    for (std::size_t sample = 0; sample < samples; ++sample)
      landings.push_back(map.landings[i] + Vector2d(moves(map.starts[i], sample)).cast<float>());
  map.landings = std::move(landings);
  map.wavelengths = samples;
  map.ends.assign(map.landings.size(), RayEnd::plate);
}

inline FlowSettings range(double first, double last) {
  FlowSettings settings;
  settings.flexibilities = {first, last};
  settings.range = true;
  return settings;
}

inline FlowSettings single(double flexibility) {
  FlowSettings settings;
  settings.flexibilities = {flexibility};
  return settings;
}

inline FlowMap map_of(const LightBench& bench, const FlowSettings& settings) {
  return trace_flow_map(bench.field, bench.geometry, bench.beam, {}, settings, Progress());
}

inline Caustic caustic_of(const LightBench& bench, const FlowMap& map,
                          const std::vector<CausticBand>& bands = {CausticBand{}}) {
  return draw_caustic(map, bench.plate(), bands, {}, Progress());
}

template <class Values>
double sum(const Values& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// The L2 distance from `exact`, as a part of its norm.
inline double relative_distance(const std::vector<double>& values, const std::vector<double>& exact) {
  const auto count = static_cast<Eigen::Index>(exact.size());
  const Eigen::Map<const Eigen::VectorXd> a(values.data(), count), b(exact.data(), count);
  return (a - b).norm() / b.norm();
}

inline double power_of(const Caustic& caustic, RayEnd end) { return caustic.power[0][static_cast<int>(end)]; }

inline double all_power(const Caustic& caustic) { return sum(caustic.power[0]); }

}  // namespace tensorray::test
