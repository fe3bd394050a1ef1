#pragma once
/// Flow maps of fields in a cube, and their light.

#include <numeric>
#include <utility>

#include "tests/tracing/support.h"
#include "tracing/flow/flow_map.h"
#include "tracing/flow_drawing/caustic.h"

namespace tensorray::test {

/// A cube in parallel light along −z, and a plate.
struct FlowBench {
  TensorField field;
  Geometry geometry;
  Beam beam;

  const Plate& plate() const { return *geometry.surfaces().plate; }
};

inline FlowBench make_bench(const TensorFunction& tensor, const Plate& plate, Surfaces extra = {}, int voxels = 17,
                            const Eigen::Vector3d& direction = {0, 0, -1}) {
  TensorField field = cube_field(voxels, tensor);
  Surfaces surfaces = std::move(extra);
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  surfaces.plate = plate;
  Beam beam = silhouette_beam(field.corners(), direction, Eigen::Vector3d::UnitY());
  return {std::move(field), Geometry(std::move(surfaces)), std::move(beam)};
}

inline Plate plate_at(double distance, double size, int resolution) {
  Plate plate = plate_across({0, 0, -1}, distance);
  plate.size = {size, size};
  plate.resolution = {resolution, resolution};
  return plate;
}

inline Eigen::Matrix3d zero(const Eigen::Vector3d&) { return Eigen::Matrix3d::Zero(); }

/// A field that focuses light of positive flexibility in the middle, and folds it further out.
inline Eigen::Matrix3d lens(const Eigen::Vector3d& at) {
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
  const double strength = -2 * std::exp(-3 * at.head<2>().squaredNorm());
  tensor(0, 2) = tensor(2, 0) = strength * at.x();
  tensor(1, 2) = tensor(2, 1) = strength * at.y();
  return tensor;
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
      map.landings.push_back(Eigen::Vector2d(landing(map.starts.back())).cast<float>());
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

inline FlowMap map_of(const FlowBench& bench, const FlowSettings& settings) {
  return trace_flow_map(bench.field, bench.geometry, bench.beam, {}, settings, Progress());
}

inline Caustic caustic_of(const FlowBench& bench, const FlowMap& map,
                          const std::vector<CausticBand>& bands = {CausticBand{}}) {
  return draw_caustic(map, bench.plate(), bands, {}, Progress());
}

inline double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

inline double power_of(const Caustic& caustic, RayEnd end) { return caustic.power[0][static_cast<int>(end)]; }

inline double all_power(const Caustic& caustic) {
  return std::accumulate(caustic.power[0].begin(), caustic.power[0].end(), 0.0);
}

}  // namespace tensorray::test
