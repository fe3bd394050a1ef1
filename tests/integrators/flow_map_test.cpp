// The flow map, and the light that it carries to its plate.

#include "integrators/flow/flow_map.h"

#include <cmath>
#include <functional>
#include <numeric>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "integrators/flow/caustic.h"
#include "integrators/flow/ray_memory.h"
#include "integrators/photons/photon_distribution.h"
#include "renderer/color/spectrum.h"
#include "tests/integrators/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A cube in parallel light along −z, and a plate.
struct Bench {
  TensorField field;
  Geometry geometry;
  Beam beam;

  const Plate& plate() const { return *geometry.surfaces().plate; }
};

Bench make_bench(const TensorFunction& tensor, const Plate& plate, Surfaces extra = {}, int voxels = 17,
                 const Vector3d& direction = {0, 0, -1}) {
  TensorField field = cube_field(voxels, tensor);
  Surfaces surfaces = std::move(extra);
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  surfaces.plate = plate;
  Beam beam = silhouette_beam(field.corners(), direction, Vector3d::UnitY());
  return {std::move(field), Geometry(std::move(surfaces)), std::move(beam)};
}

Plate plate_at(double distance, double size, int resolution) {
  Plate plate = plate_across({0, 0, -1}, distance);
  plate.size = {size, size};
  plate.resolution = {resolution, resolution};
  return plate;
}

Matrix3d zero(const Vector3d&) { return Matrix3d::Zero(); }

/// A field that focuses light of positive flexibility in the middle, and folds it further out.
Matrix3d lens(const Vector3d& at) {
  Matrix3d tensor = Matrix3d::Zero();
  const double strength = -2 * std::exp(-3 * at.head<2>().squaredNorm());
  tensor(0, 2) = tensor(2, 0) = strength * at.x();
  tensor(1, 2) = tensor(2, 1) = strength * at.y();
  return tensor;
}

FlowSettings range(double first, double last) {
  FlowSettings settings;
  settings.flexibilities = {first, last};
  settings.range = true;
  return settings;
}

FlowSettings single(double flexibility) {
  FlowSettings settings;
  settings.flexibilities = {flexibility};
  return settings;
}

FlowMap map_of(const Bench& bench, const FlowSettings& settings) {
  return trace_flow_map(bench.field, bench.geometry, bench.beam, {}, settings, Progress());
}

Caustic caustic_of(const Bench& bench, const FlowMap& map, const std::vector<CausticBand>& bands = {CausticBand{}}) {
  return draw_caustic(map, bench.plate(), bands, 1, true, Progress());
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

double power_of(const Caustic& caustic, RayEnd end) { return caustic.power[0][static_cast<int>(end)]; }

double all_power(const Caustic& caustic) {
  return std::accumulate(caustic.power[0].begin(), caustic.power[0].end(), 0.0);
}

/// What `photons` single photons of the same light give, with the standard deviation of the noise of their number.
Film histogram(const Bench& bench, double flexibility, std::uint64_t photons) {
  PhotonSettings settings;
  settings.photons = photons;
  settings.density.kind = DensityKind::histogram;
  return distribute_photons(bench.field, bench.geometry, bench.beam, {{flexibility, 550, 1}}, {}, settings, Progress())
      .irradiance;
}

/// The greatest value of a pixel and its eight neighbours.
double greatest_near(const Film& film, int x, int y) {
  double greatest = 0;
  for (int v = std::max(0, y - 1); v < std::min(film.height, y + 2); ++v)
    for (int u = std::max(0, x - 1); u < std::min(film.width, x + 2); ++u)
      greatest = std::max(greatest, film.plane(0)[v * film.width + u]);
  return greatest;
}

/// Compares the light of the map with single photons: the deviations of the pixels, in units of the noise of the
/// photons' number and of the light that the map's tolerance may move across a pixel's edge, are those of noise.
void expect_same_light(const Bench& bench, double flexibility, const char* label) {
  constexpr std::uint64_t photons = 400000;
  const Film expected = histogram(bench, flexibility, photons);
  FlowSettings settings = single(flexibility);
  settings.tolerance = 0.05;
  const Caustic caustic = caustic_of(bench, map_of(bench, settings));
  EXPECT_NEAR(all_power(caustic), 1, 1e-9) << label;
  const double per_photon = area(bench.beam.aperture) / static_cast<double>(photons) / bench.plate().pixel_area();
  double squares = 0;
  for (int y = 0; y < expected.height; ++y)
    for (int x = 0; x < expected.width; ++x) {
      const double light = caustic.irradiance.plane(0)[y * expected.width + x];
      const double moved = settings.tolerance * greatest_near(caustic.irradiance, x, y);
      const double noise = std::sqrt(std::max(light, per_photon) * per_photon) + moved;
      squares += std::pow((light - expected.plane(0)[y * expected.width + x]) / noise, 2);
    }
  EXPECT_LT(squares / static_cast<double>(expected.values.size()), 1) << label;
  EXPECT_NEAR(sum(caustic.irradiance.values) / sum(expected.values), 1, 2e-3) << label;
}

/// With a memory, light to another plate is traced only where it was not traced before.
TEST(FlowMap, RememberedRaysGiveTheSameMap) {
  FlowSettings settings;
  settings.flexibilities = {0.1, 0.4};
  settings.range = true;
  FlowSettings remembering = settings;
  remembering.memory = std::make_shared<RayMemory>();
  std::vector<std::uint64_t> samples;
  for (const double distance : {2.0, 2.1, 2.0}) {
    const Bench bench = make_bench(lens, plate_at(distance, 4, 64));
    const FlowMap map = trace_flow_map(bench.field, bench.geometry, bench.beam, {}, remembering, Progress());
    const FlowMap expected = trace_flow_map(bench.field, bench.geometry, bench.beam, {}, settings, Progress());
    EXPECT_EQ(map.landings, expected.landings);
    EXPECT_EQ(map.ends, expected.ends);
    EXPECT_EQ(map.lengths, expected.lengths);
    EXPECT_EQ(map.starts, expected.starts);
    samples.push_back(map.tensor_samples);
  }
  EXPECT_LT(2 * samples[1], samples[0]);
  EXPECT_EQ(samples[2], 0u);
}

TEST(FlowMap, RaysAreRememberedOnlyWhereTheyMeetNothingElse) {
  const auto serves = [](const Bench& bench) {
    return RayMemory::serves(bench.field, bench.geometry, bench.beam.direction, {});
  };
  EXPECT_TRUE(serves(make_bench(lens, plate_at(2, 4, 64))));
  EXPECT_FALSE(serves(make_bench(lens, plate_at(0.5, 4, 64))));  // Inside.
  EXPECT_FALSE(serves(make_bench(lens, plate_at(-2, 4, 64))));   // In front.
  Surfaces extra;
  extra.obstacles.push_back(
      box_mesh(Eigen::AlignedBox3d(Vector3d(-0.2, -0.2, -2), Vector3d(0.2, 0.2, -1.8)), Eigen::Affine3d::Identity()));
  EXPECT_FALSE(serves(make_bench(lens, plate_at(3, 4, 64), extra)));
}

TEST(FlowMap, CoversTheApertureOnce) {
  for (const Vector3d& direction : {Vector3d(0, 0, -1), Vector3d(0.3, 0.2, -1), Vector3d(1, 1, -1)}) {
    Plate plate = plate_across(direction, 3);
    plate.size = {4, 4};
    plate.resolution = {64, 64};
    const Bench bench = make_bench(lens, plate, {}, 9, direction);
    const FlowMap map = map_of(bench, single(0.3));
    double covered = 0;
    for (const FlowTriangle& triangle : map.triangles) {
      EXPECT_GT(triangle.area, 0);
      covered += triangle.area;
    }
    EXPECT_NEAR(covered, area(bench.beam.aperture), 1e-9);
    // Each triangle has three edges.
    std::vector<int> sides(map.triangles.size());
    for (const FlowEdge& edge : map.edges)
      for (const std::uint32_t triangle : {edge.along, edge.against})
        if (triangle != FlowEdge::none) ++sides[triangle];
    for (const int count : sides) ASSERT_EQ(count, 3);
  }
}

TEST(FlowMap, UndisturbedLightIsExactlyOne) {
  const Bench bench = make_bench(zero, plate_at(2, 1.5, 48));  // The beam is wider than the plate.
  const Caustic caustic = caustic_of(bench, map_of(bench, single(0.3)));
  for (const double value : caustic.irradiance.values) ASSERT_NEAR(value, 1, 2e-5);  // Landings are single precision.
  EXPECT_NEAR(power_of(caustic, RayEnd::plate), 1.5 * 1.5 / 4, 1e-6);
  EXPECT_NEAR(power_of(caustic, RayEnd::missed), 1 - 1.5 * 1.5 / 4, 1e-6);
}

TEST(FlowMap, IsTheLightOfSinglePhotons) {
  expect_same_light(make_bench(lens, plate_at(2.2, 3, 48)), 0.4, "folded light");
  expect_same_light(make_bench(lens, plate_at(2.2, 0.8, 48)), 0.4, "a plate that is smaller than the light");
  expect_same_light(make_bench(lens, plate_at(0.3, 3, 48)), 0.4, "a plate inside the volume");
  expect_same_light(make_bench(lens, plate_at(40, 60, 48)), 0.2, "a far plate");
  expect_same_light(make_bench(lens, plate_at(2.2, 3, 48), {}, 5), 0.4, "large voxels");
  Plate tilted = plate_at(2.5, 4, 48);
  const Eigen::AngleAxisd turn(0.7, Vector3d(1, 0.4, 0).normalized());
  tilted.right = turn * tilted.right;
  tilted.up = turn * tilted.up;
  expect_same_light(make_bench(lens, tilted), 0.4, "a tilted plate");
}

TEST(FlowMap, EndsAtObstaclesAndCuts) {
  Surfaces surfaces;
  surfaces.obstacles.push_back(box_mesh(Eigen::AlignedBox3d(Vector3d(-0.4, -0.3, -1.6), Vector3d(0.2, 0.25, -1.5)),
                                        Eigen::Affine3d::Identity()));
  const Bench shadow = make_bench(lens, plate_at(2.2, 3, 48), surfaces);
  expect_same_light(shadow, 0.4, "an obstacle's shadow");
  EXPECT_GT(power_of(caustic_of(shadow, map_of(shadow, single(0.4))), RayEnd::obstacle), 0.003);
  Surfaces cut;
  cut.cut =
      box_mesh(Eigen::AlignedBox3d(Vector3d(-0.5, -0.6, -0.7), Vector3d(0.6, 0.4, 0.8)), Eigen::Affine3d::Identity());
  expect_same_light(make_bench(lens, plate_at(2.2, 3, 48), cut), 0.4, "a cut volume");
}

/// Landings between traced nodes are those of rays of the flexibility between them.
TEST(FlowMap, InterpolatedLandingsAreThoseOfRays) {
  const Bench bench = make_bench(lens, plate_at(2.2, 3, 256));
  const FlowSettings settings = range(0.1, 0.6);
  const FlowMap map = map_of(bench, settings);
  EXPECT_LT(static_cast<double>(map.rays), 20.0 * static_cast<double>(map.starts.size()));  // Of 33.
  RayBatch batch;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < map.starts.size(); i += 7) {
    const std::size_t node = i % map.nodes;
    const Vector2d& start = map.starts[i];
    batch.add(bench.beam.center + start.x() * bench.beam.right + start.y() * bench.beam.up, bench.beam.direction,
              0.1 + 0.5 * static_cast<double>(node) / static_cast<double>(map.nodes - 1));
    which.push_back(i * map.nodes + node);
  }
  trace(bench.field, bench.geometry, {}, batch);
  std::size_t compared = 0, near = 0;
  for (std::size_t k = 0; k < which.size(); ++k) {
    if (batch.end[k] != RayEnd::plate || map.ends[which[k]] != RayEnd::plate) continue;
    ++compared;
    near += (bench.plate().to_pixel(batch.position[k]) - map.landings[which[k]].cast<double>()).norm() < 0.25;
  }
  EXPECT_GT(compared, 100u);
  // Positions that were added in the middle of squares have the mean of the corners' landings.
  EXPECT_GT(static_cast<double>(near), 0.97 * static_cast<double>(compared));
}

/// The map with all nodes traced, of the positions that were traced at all (others lie in the middle of two).
FlowMap with_all_nodes(const Bench& bench, const FlowSettings& settings, FlowMap map) {
  RayBatch batch;
  for (const Vector2d& start : map.starts)
    for (std::size_t node = 0; node < map.nodes; ++node) {
      const double part = static_cast<double>(node) / static_cast<double>(map.nodes - 1);
      batch.add(bench.beam.center + start.x() * bench.beam.right + start.y() * bench.beam.up, bench.beam.direction,
                (1 - part) * settings.flexibilities[0] + part * settings.flexibilities[1]);
    }
  trace(bench.field, bench.geometry, {}, batch);
  for (std::size_t first = 0; first < batch.size(); first += map.nodes) {
    const auto landing = [&](std::size_t node) -> Eigen::Vector2f {
      return bench.plate().to_pixel(batch.position[first + node]).cast<float>();
    };
    bool was_traced = true;
    for (std::size_t node = 0; node < map.nodes; node += map.check_step)
      was_traced = was_traced && batch.end[first + node] == RayEnd::plate &&
                   (landing(node) - map.landings[first + node]).norm() < 1e-3f;
    for (std::size_t node = 0; was_traced && node < map.nodes; ++node)
      if (map.ends[first + node] == RayEnd::plate) map.landings[first + node] = landing(node);
  }
  return map;
}

/// CIE L*a*b*, where `white` is white.
Vector3d lab(const Vector3d& xyz, const Vector3d& white) {
  Vector3d f;
  for (int i = 0; i < 3; ++i) {
    const double part = xyz[i] / white[i];
    f[i] = part > 216.0 / 24389 ? std::cbrt(part) : (24389.0 / 27 * part + 16) / 116;
  }
  return {116 * f.y() - 16, 500 * (f.x() - f.y()), 200 * (f.y() - f.z())};
}

TEST(FlowMap, InterpolatedWavelengthsHardlyChangeColours) {
  constexpr int count = 64;
  std::vector<CausticBand> bands;
  Vector3d white = Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    const double place = (i + 0.5) / count;
    bands.push_back({32 * place, 0, 0, 1.0 / count, observer(380 + 400 * place)});
    white += bands.back().color;
  }
  const Bench bench = make_bench(lens, plate_at(2.2, 3, 64));
  FlowSettings settings = range(0.1, 0.3);
  settings.tolerance = 0.03;
  const FlowMap few = map_of(bench, settings);
  EXPECT_LT(static_cast<double>(few.rays), 0.3 * static_cast<double>(few.landings.size()));
  const Film a = caustic_of(bench, few, bands).color,
             b = caustic_of(bench, with_all_nodes(bench, settings, few), bands).color;
  double greatest = 0;
  for (std::size_t i = 0; i < a.plane_size(); ++i) {
    const auto at = [&](const Film& film) {
      return lab({film.plane(0)[i], film.plane(1)[i], film.plane(2)[i]}, white);
    };
    greatest = std::max(greatest, (at(a) - at(b)).norm());
  }
  EXPECT_LT(greatest, 0.5);
  EXPECT_GT(greatest, 0);
}

TEST(FlowMap, TheSameOnAnyNumberOfThreads) {
  const Bench bench = make_bench(lens, plate_at(2.2, 3, 64));
  std::vector<Caustic> caustics;
  for (const std::size_t threads : {1, 2, 8}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const FlowMap map = map_of(bench, range(0.1, 0.6));
    std::vector<CausticBand> bands;
    for (int i = 0; i < 20; ++i) bands.push_back({(i + 0.5) / 20 * 32, 1.6, 0, 0.05, Vector3d(0.05, 0.1, i)});
    caustics.push_back(caustic_of(bench, map, bands));
  }
  for (const Caustic& caustic : caustics) {
    EXPECT_EQ(caustic.irradiance.values, caustics[0].irradiance.values);
    EXPECT_EQ(caustic.color.values, caustics[0].color.values);
    EXPECT_EQ(caustic.power, caustics[0].power);
  }
}

/// The error falls at least as the tolerance does: with a sixteenth of the tolerance there is a sixteenth of the error.
TEST(FlowMap, ConvergesWithItsTolerance) {
  const Bench bench = make_bench(lens, plate_at(2.2, 3, 128));
  const auto light = [&](double tolerance) {
    FlowSettings settings = single(0.1);
    settings.tolerance = tolerance;
    return caustic_of(bench, map_of(bench, settings)).irradiance.values;
  };
  const std::vector<double> exact = light(0.002);
  std::vector<double> errors;
  for (const double tolerance : {0.8, 0.2, 0.05}) {
    const std::vector<double> values = light(tolerance);
    double squares = 0, all = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      squares += std::pow(values[i] - exact[i], 2);
      all += exact[i] * exact[i];
    }
    errors.push_back(std::sqrt(squares / all));
  }
  EXPECT_LT(errors[2], 0.02);
  EXPECT_LT(errors[2], errors[0] / 16);
}

TEST(FlowMap, KeepsToItsNumberOfPositions) {
  const Bench bench = make_bench(lens, plate_at(2.2, 3, 512));
  for (const std::size_t most : {1u, 100u, 3000u}) {
    FlowSettings settings = single(0.4);
    settings.most_starts = most;
    const FlowMap map = map_of(bench, settings);
    EXPECT_LT(map.starts.size(), 2 * most + 64);  // Positions in the middles of squares come on top.
    EXPECT_FALSE(map.is_complete);
    EXPECT_NEAR(all_power(caustic_of(bench, map)), 1, 1e-9);
  }
  EXPECT_TRUE(map_of(make_bench(lens, plate_at(2.2, 3, 32)), single(0.1)).is_complete);
}

TEST(FlowMap, BadSettingsAreRefused) {
  const Bench bench = make_bench(zero, plate_at(2, 3, 8));
  FlowSettings settings;
  EXPECT_THROW(map_of(bench, settings), std::invalid_argument);
  settings = single(0.1);
  settings.range = true;
  EXPECT_THROW(map_of(bench, settings), std::invalid_argument);
  settings = single(0.1);
  settings.tolerance = std::nan("");
  EXPECT_THROW(map_of(bench, settings), std::invalid_argument);
  settings = single(0.1);
  settings.most_starts = 0;
  EXPECT_THROW(map_of(bench, settings), std::invalid_argument);
}

TEST(FlowMap, CanBeCancelled) {
  const Bench bench = make_bench(lens, plate_at(2, 3, 64));
  Progress progress;
  progress.cancelled = true;
  EXPECT_THROW(trace_flow_map(bench.field, bench.geometry, bench.beam, {}, single(0.1), progress), Cancelled);
}

/// A map that is given, over a lattice of `count` × `count` squares of the unit square.
template <class Map>
FlowMap lattice_map(int count, const Map& map) {
  FlowMap result;
  for (int y = 0; y <= count; ++y)
    for (int x = 0; x <= count; ++x) {
      result.starts.emplace_back(double(x) / count, double(y) / count);
      result.landings.push_back(map(result.starts.back()).template cast<float>());
    }
  result.ends.assign(result.starts.size(), RayEnd::plate);
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto triangle = static_cast<std::uint32_t>(result.triangles.size());
    result.triangles.push_back({{a, b, c}, 0.5 / count / count, false});
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
      result.edges.push_back({from, to, triangle});
  };
  for (int y = 0; y < count; ++y)
    for (int x = 0; x < count; ++x) {
      const auto a = static_cast<std::uint32_t>(y * (count + 1) + x), up = static_cast<std::uint32_t>(count + 1);
      add(a, a + 1, a + up + 1);
      add(a, a + up + 1, a + up);
    }
  return result;
}

/// L2 distance from `exact`, the power of each pixel, as a part of its norm. The power is exact.
double distance(const FlowMap& map, const Plate& plate, const std::vector<double>& exact) {
  const Caustic caustic = draw_caustic(map, plate, {CausticBand{}}, 1, true, Progress());
  EXPECT_NEAR(power_of(caustic, RayEnd::plate), sum(exact), 1e-6);
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    squares += std::pow(caustic.irradiance.values[i] * plate.pixel_area() - exact[i], 2);
    all += exact[i] * exact[i];
  }
  return std::sqrt(squares / all);
}

constexpr int pixels = 64;

Plate unit_plate() {
  Plate plate;
  plate.resolution = {pixels, pixels};
  return plate;
}

/// A fold: x = c + k (u − ½)². The light of a column is the part of u that lands there, on both sides of the fold.
double fold_error(int count) {
  constexpr double c = 10.3, k = 160;
  const FlowMap map = lattice_map(
      count, [&](const Vector2d& at) { return Vector2d(c + k * (at.x() - 0.5) * (at.x() - 0.5), 5 + 50 * at.y()); });
  std::vector<double> exact(pixels * pixels);
  const auto below = [&](double x) { return 2 * std::sqrt(std::clamp((x - c) / k, 0.0, 0.25)); };
  for (int y = 5; y < 55; ++y)
    for (int x = 0; x < pixels; ++x)
      exact[static_cast<std::size_t>(y) * pixels + static_cast<std::size_t>(x)] = (below(x + 1) - below(x)) / 50;
  return distance(map, unit_plate(), exact);
}

TEST(Caustic, FoldHasItsClosedForm) {
  EXPECT_LT(fold_error(128), 0.01);  // 16,384 rays.
  EXPECT_LT(fold_error(64), 0.03);
  EXPECT_LT(fold_error(256), fold_error(128) / 2);
}

/// A cusp: x = c + k (t³ + t (v − ½)), t = 2 (u − ½). For each v, the light between two places is the length of the set
/// of t that lands there: the differences of the cubic's roots.
double cusp_error(int count) {
  constexpr double c = 32, k = 20;
  const auto cubic = [](double t, double v) { return t * t * t + t * (v - 0.5); };
  const FlowMap map = lattice_map(
      count, [&](const Vector2d& at) { return Vector2d(c + k * cubic(2 * at.x() - 1, at.y()), 2 + 60 * at.y()); });
  std::vector<double> exact(pixels * pixels);
  constexpr int lines = 60 * 64;  // Of v; 64 for each row of pixels.
  for (int line = 0; line < lines; ++line) {
    const double v = (line + 0.5) / lines;
    const auto row = static_cast<std::size_t>(2 + line / 64) * pixels;
    // Monotone pieces in t, each inverted by bisection.
    const double turn = v < 0.5 ? std::sqrt((0.5 - v) / 3) : 0;
    for (const auto& [low, high] : {std::pair(-1.0, -turn), std::pair(-turn, turn), std::pair(turn, 1.0)}) {
      if (low == high) continue;
      const auto at = [&, low = low, high = high](double x) {
        double a = low, b = high;
        const bool rises = cubic(b, v) > cubic(a, v);
        for (int i = 0; i < 40; ++i) ((c + k * cubic((a + b) / 2, v) < x) == rises ? a : b) = (a + b) / 2;
        return a;
      };
      double before = at(0);
      for (int x = 0; x < pixels; ++x) {
        const double next = at(x + 1);
        exact[row + static_cast<std::size_t>(x)] += std::abs(next - before) / 2 / lines;
        before = next;
      }
    }
  }
  return distance(map, unit_plate(), exact);
}

TEST(Caustic, CuspHasItsClosedForm) {
  EXPECT_LT(cusp_error(128), 0.01);  // 16,384 rays.
  EXPECT_LT(cusp_error(256), cusp_error(128) / 2);
}

/// Away from folds the error is of second order in the size of the squares.
TEST(Caustic, IsOfSecondOrderWhereNothingFolds) {
  const auto error = [](int count) {
    const FlowMap map = lattice_map(
        count, [](const Vector2d& at) { return Vector2d(5 + 40 * (at.x() + 0.3 * at.x() * at.x()), 4 + 54 * at.y()); });
    std::vector<double> exact(pixels * pixels);
    const auto start = [](double x) {  // The inverse of the map.
      const double s = std::clamp((x - 5) / 40, 0.0, 1.3);
      return (std::sqrt(1 + 1.2 * s) - 1) / 0.6;
    };
    for (int y = 4; y < 58; ++y)
      for (int x = 0; x < pixels; ++x)
        exact[static_cast<std::size_t>(y) * pixels + static_cast<std::size_t>(x)] = (start(x + 1) - start(x)) / 54;
    return distance(map, unit_plate(), exact);
  };
  const double coarse = error(128), fine = error(512);
  EXPECT_LT(coarse, 1e-3);
  EXPECT_LT(fine, coarse / 10);  // 16 for second order.
}

/// The light of one band between two nodes, of which each position moves by `moves`, and that of many narrow bands.
std::pair<Film, Film> swept_and_narrow(const std::function<Vector2d(const Vector2d&)>& moves, int bands) {
  FlowMap map = lattice_map(8, [](const Vector2d& at) { return Vector2d(5 + 20 * at.x(), 5 + 40 * at.y()); });
  std::vector<Eigen::Vector2f> landings;
  for (std::size_t i = 0; i < map.starts.size(); ++i)
    landings.insert(landings.end(), {map.landings[i], map.landings[i] + moves(map.starts[i]).cast<float>()});
  map.landings = landings;
  map.nodes = 2;
  map.ends.assign(landings.size(), RayEnd::plate);
  CausticBand whole;
  whole.node = 0.5;
  whole.width = 1;
  std::vector<CausticBand> narrow(bands);
  for (int i = 0; i < bands; ++i) {
    narrow[i].node = (i + 0.5) / bands;
    narrow[i].weight = 1.0 / bands;
  }
  const auto draw = [&](const std::vector<CausticBand>& each) {
    const Caustic caustic = draw_caustic(map, unit_plate(), each, 1, true, Progress(), 1);
    EXPECT_NEAR(all_power(caustic), 1, 1e-9);
    return caustic.irradiance;
  };
  return {draw({whole}), draw(narrow)};
}

TEST(Caustic, ABandIsSweptInStepsOfAPixel) {
  const auto [swept, narrow] = swept_and_narrow([](const Vector2d&) { return Vector2d(12.5, 3); }, 13);
  for (std::size_t i = 0; i < swept.values.size(); ++i) ASSERT_NEAR(swept.values[i], narrow.values[i], 1e-9) << i;
  // Triangles that move by a different number of pixels still meet.
  const auto [bent, exact] = swept_and_narrow([](const Vector2d& at) { return Vector2d(14 * at.y(), 0); }, 400);
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < bent.values.size(); ++i) {
    squares += std::pow(bent.values[i] - exact.values[i], 2);
    all += std::pow(exact.values[i], 2);
  }
  EXPECT_LT(std::sqrt(squares / all), 0.02);
}

/// The picture does not depend on whether the channels' irradiance is wanted, and is what the channels add up to.
TEST(Caustic, ChannelsAddUpToTheColours) {
  const Bench bench = make_bench(lens, plate_at(2.2, 3, 96));
  const FlowMap map = map_of(bench, range(0.1, 0.4));
  constexpr std::size_t channels = 6, parts = 5;
  std::vector<CausticBand> bands(channels * parts);
  for (std::size_t i = 0; i < bands.size(); ++i) {
    const double width = static_cast<double>(map.nodes - 1) / static_cast<double>(bands.size());
    bands[i].node = (static_cast<double>(i) + 0.5) * width;
    bands[i].width = width;
    bands[i].channel = i / parts;
    bands[i].weight = 1.0 / parts;
    bands[i].color = Eigen::Vector3d(1, 0.5, -0.1) * static_cast<double>(1 + i / parts) / parts;
  }
  const Caustic colors = draw_caustic(map, bench.plate(), bands, channels, false, Progress());
  const Caustic both = draw_caustic(map, bench.plate(), bands, channels, true, Progress());
  EXPECT_EQ(colors.color.values, both.color.values);
  EXPECT_EQ(colors.power, both.power);
  for (std::size_t channel = 0; channel < channels; ++channel)
    EXPECT_NEAR(std::accumulate(both.power[channel].begin(), both.power[channel].end(), 0.0), 1, 1e-9);
  for (std::size_t pixel = 0; pixel < both.color.plane_size(); ++pixel) {
    double red = 0;
    for (std::size_t channel = 0; channel < channels; ++channel)
      red += static_cast<double>(channel + 1) * both.irradiance.plane(static_cast<int>(channel))[pixel];
    ASSERT_NEAR(both.color.plane(0)[pixel], red, 1e-6 * (1 + red));
    ASSERT_NEAR(both.color.plane(1)[pixel], 0.5 * red, 1e-6 * (1 + red));
  }
}

TEST(Caustic, LightThatMovesFarHasManyBands) {
  FlowMap map = lattice_map(2, [](const Vector2d& at) { return at; });
  map.nodes = 2;
  std::vector<Eigen::Vector2f> landings;
  for (const Eigen::Vector2f& at : map.landings) landings.insert(landings.end(), {at, at + Eigen::Vector2f(21, 0)});
  map.landings = landings;
  map.ends.assign(landings.size(), RayEnd::plate);
  EXPECT_EQ(band_count(map, 1), 21);
  EXPECT_EQ(band_count(map, 4), 24);
  EXPECT_EQ(band_count(map, 32), 32);
  EXPECT_EQ(band_count(map, 1000), 1000);
  for (std::size_t i = 1; i < map.landings.size(); i += 2) map.landings[i].x() += 1000;
  EXPECT_EQ(band_count(map, 4), 128);
}

}  // namespace
}  // namespace tensorray
