#include "tracing/flow/flow_map.h"

#include <cstring>

#include "base/constants.h"
#include "base/process/job.h"
#include "integrators/photon_distribution/photon_distribution.h"
#include "tests/base/rank_support.h"
#include "tests/tracing/flow_support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

using Eigen::Vector2f;

/// What `photons` single photons of the same light give, with the standard deviation of the noise of their number.
Film histogram(const LightBench& bench, double flexibility, std::uint64_t photons) {
  PhotonSettings settings;
  settings.photons = photons;
  settings.density.kind = DensityKind::histogram;
  return distribute_photons(bench.field, bench.geometry, bench.beam, {{flexibility, 550, 1}}, settings, Progress())
      .irradiance;
}

/// The greatest value of a pixel and its eight neighbours.
double max_near(const Film& film, int x, int y) {
  double greatest = 0;
  for (int v = std::max(0, y - 1); v < std::min(film.height, y + 2); ++v)
    for (int u = std::max(0, x - 1); u < std::min(film.width, x + 2); ++u)
      greatest = std::max(greatest, film.plane(0)[v * film.width + u]);
  return greatest;
}

/// Compares the light of the map with single photons: the deviations of the pixels, in units of the noise of the
/// photons' number and of the light that the map's tolerance may move across a pixel's edge, are those of noise.
void expect_same_light(const LightBench& bench, double flexibility, const char* label) {
  constexpr double photons = 50000;
  const Film expected = histogram(bench, flexibility, static_cast<std::uint64_t>(photons));
  FlowSettings settings = single(flexibility);
  settings.tolerance = 0.05;
  const Caustic caustic = caustic_of(bench, map_of(bench, settings));
  EXPECT_NEAR(all_power(caustic), 1, 1e-9) << label;
  const double per_photon = area(bench.beam.aperture) / photons / bench.plate().pixel_area();
  double squares = 0;
  for (int y = 0; y < expected.height; ++y)
    for (int x = 0; x < expected.width; ++x) {
      const double light = caustic.irradiance.plane(0)[y * expected.width + x];
      const double moved = settings.tolerance * max_near(caustic.irradiance, x, y);
      const double noise = std::sqrt(std::max(light, per_photon) * per_photon) + moved;
      squares += std::pow((light - expected.plane(0)[y * expected.width + x]) / noise, 2);
    }
  EXPECT_LT(squares / static_cast<double>(expected.values.size()), 1) << label;
  const double landed = sum(expected.values) / per_photon;  // Photons, of which the number is binomial.
  const double noise = std::sqrt(std::max(photons - landed, 1.0) / photons / landed);
  EXPECT_NEAR(sum(caustic.irradiance.values) / sum(expected.values), 1, 4 * noise) << label;
}

TEST(FlowMap, UndisturbedLightIsExactlyOne) {
  const LightBench bench = make_bench(zero, plate_at(2, 1.5, 48));  // The beam is wider than the plate.
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
  const Surfaces cut = cut_between({-0.5, -0.6, -0.7}, {0.6, 0.4, 0.8});
  expect_same_light(make_bench(lens, plate_at(2.2, 3, 48), cut), 0.4, "a cut volume");
  const Surfaces obstacle = obstacle_between({-0.4, -0.3, -1.6}, {0.2, 0.25, -1.5});
  const LightBench shadow = make_bench(lens, plate_at(2.2, 3, 48), obstacle);
  expect_same_light(shadow, 0.4, "an obstacle's shadow");
  EXPECT_GT(power_of(caustic_of(shadow, map_of(shadow, single(0.4))), RayEnd::obstacle), 0.003);
}

/// A field that pushes light out at its faces ±x, and back in where it has come far enough: it ends where it began, but
/// light that starts within 0.04 of the face, a third of a voxel, leaves through it, and lands up to 0.2 beside.
Matrix3d hook(const Vector3d& at) {
  constexpr double width = 0.04, flexibility = 0.4;
  Matrix3d tensor = Matrix3d::Zero();
  tensor(0, 2) = -at.x() * width * pi * pi / 2 / flexibility * std::cos(pi * (1 - at.z()));
  return tensor;
}

/// Corners of quads at the edge of the beam agree, and what lies between them lands elsewhere.
TEST(FlowMap, LightThatLeavesBetweenCornersIsNotOverlooked) {
  constexpr double size = 3;
  for (const int resolution : {64, 256}) {
    const LightBench bench = make_bench(hook, plate_at(4, size, resolution));
    const Film light = caustic_of(bench, map_of(bench, single(0.4))).irradiance;
    const Film expected = histogram(bench, 0.4, 50000);
    const auto beside = [&](const Film& film) {  // More than 0.05 beside the undisturbed beam.
      double sum = 0;
      for (int y = 0; y < resolution; ++y)
        for (int x = 0; x < resolution; ++x)
          if (std::abs((x + 0.5) / resolution - 0.5) * size > 1.05) sum += film.plane(0)[y * resolution + x];
      return sum * bench.plate().pixel_area() / area(bench.beam.aperture);
    };
    // Where light is torn, half of a smallest quad may be on the wrong side, or of one twice as large, if the tear is
    // only a few pixels wide; the beam is 2 wide.
    const double part = beside(expected), noise = std::sqrt(part / 50000),
                 torn = 2 * 0.5 * 2 * single(0.4).finest * size / resolution / 2;
    EXPECT_GT(part, 0.02);
    EXPECT_NEAR(beside(light), part, 4 * noise + torn) << resolution;
  }
}

/// Landings between traced samples are those of rays of the flexibility between them.
TEST(FlowMap, InterpolatedLandingsAreThoseOfRays) {
  const LightBench bench = make_bench(lens, plate_at(2.2, 3, 256));
  const FlowMap map = map_of(bench, range(0.1, 0.6));
  EXPECT_LT(static_cast<double>(map.rays), 20.0 * static_cast<double>(map.starts.size()));  // Of 33.
  RayBatch batch;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < map.starts.size(); i += 7) {
    const std::size_t sample = i % map.wavelengths;
    const Vector2d& start = map.starts[i];
    batch.add(bench.beam.center + start.x() * bench.beam.right + start.y() * bench.beam.up, bench.beam.direction,
              0.1 + 0.5 * static_cast<double>(sample) / static_cast<double>(map.wavelengths - 1));
    which.push_back(i * map.wavelengths + sample);
  }
  trace(bench.field, bench.geometry, {}, batch);
  std::size_t compared = 0, near = 0, nearest = 0;
  for (std::size_t k = 0; k < which.size(); ++k) {
    if (batch.end[k] != RayEnd::plate || map.ends[which[k]] != RayEnd::plate) continue;
    ++compared;
    const double apart = (bench.plate().to_pixel(batch.position[k]) - map.landings[which[k]].cast<double>()).norm();
    near += apart < 0.25;
    nearest += apart < 0.05;
  }
  EXPECT_GT(compared, 100u);
  EXPECT_GT(static_cast<double>(near), 0.97 * static_cast<double>(compared));
  EXPECT_GT(static_cast<double>(nearest), 0.7 * static_cast<double>(compared)) << "the prediction's own error";
}

TEST(FlowMap, SideLightOfARangeIsLeftOutAtEachWavelength) {
  const LightBench bench = make_bench([](const Vector3d&) { return sideways({-0.3, -0.15}); }, plate_at(1.2, 8, 256));
  FlowSettings settings = range(0, 1);
  settings.side_light = false;
  const FlowMap map = map_of(bench, settings);
  settings.finest = 0.0625;
  const FlowMap fine = map_of(bench, settings);
  const double fifth = 0.2 * 4 * 2 * 8.0 / 256 / area(bench.beam.aperture);  // Of a pixel, along the silhouette.
  double last = -1;
  for (std::size_t sample = 0; sample < map.wavelengths; sample += 8) {  // Light bends more and more.
    const CausticBand band{static_cast<double>(sample)};
    const double side = power_of(caustic_of(bench, map, {band}), RayEnd::side);
    EXPECT_GT(side, last) << sample;
    EXPECT_NEAR(side, power_of(caustic_of(bench, fine, {band}), RayEnd::side), fifth) << sample;
    last = side;
  }
}

/// The edge of a shadow is elsewhere at each wavelength. Between vertices it is within a tenth of a pixel.
TEST(FlowMap, ShadowsOfARangeNeedNoFineQuads) {
  const LightBench bench =
      make_bench(lens, plate_at(2.2, 3, 256), obstacle_between({-0.5, -0.4, -1.6}, {0.3, 0.45, -1.5}));
  const auto traced = [&](double finest) {
    FlowSettings settings = range(0.02, 0.1);
    settings.finest = finest;
    return map_of(bench, settings);
  };
  const FlowMap map = traced(0.5), fine = traced(0.0625);
  EXPECT_LT(3 * map.starts.size(), fine.starts.size());
  const double tenth = 0.1 * 2 * (0.8 + 0.85) * 3 / 256 / area(bench.beam.aperture);  // Of a pixel, along the edge.
  std::vector<double> values, exact_values;
  for (const double sample : {3.0, 11.6, 20.0, 28.3}) {
    const CausticBand band{sample};
    const Caustic light = caustic_of(bench, map, {band}), exact = caustic_of(bench, fine, {band});
    EXPECT_NEAR(power_of(light, RayEnd::obstacle), power_of(exact, RayEnd::obstacle), tenth) << sample;
    values.insert(values.end(), light.irradiance.values.begin(), light.irradiance.values.end());
    exact_values.insert(exact_values.end(), exact.irradiance.values.begin(), exact.irradiance.values.end());
  }
  EXPECT_LT(relative_distance(values, exact_values), 0.01);
}

/// Quads are divided to the last only where some light does not land; elsewhere, folds ask for the last but one.
TEST(FlowMap, TheLastDivisionIsForEdges) {
  const auto least = [](double finest, bool has_edges) {  // The area of a triangle away from the silhouette.
    const Surfaces surfaces = has_edges ? obstacle_between({-0.5, -0.4, -1.6}, {0.3, 0.45, -1.5}) : Surfaces();
    const auto folds = [](const Vector3d& at) { return sideways({0.15 * std::sin(50 * at.x()), 0}); };
    const LightBench bench = make_bench(folds, plate_at(2.2, 4, 256), surfaces, 65);
    FlowSettings settings = single(0.1);
    settings.finest = finest;
    const FlowMap map = map_of(bench, settings);
    double area = 1;
    for (const FlowTriangle& triangle : map.triangles)
      if (map.starts[triangle.corners[0]].cwiseAbs().maxCoeff() < 0.7) area = std::min(area, triangle.area);
    return area;
  };
  EXPECT_NEAR(least(0.5, false) / least(0.25, false), 4, 1e-9);
  EXPECT_NEAR(least(0.5, false) / least(0.5, true), 4, 1e-9);
}

/// Where large quads are smooth, their light is even within a triangle, which is of first order in their size: the
/// error falls by more than half with a quarter of the tolerance, and by more where quads are near a pixel.
TEST(FlowMap, ConvergesWithItsTolerance) {
  const LightBench bench = make_bench(lens, plate_at(2.2, 3, 128));
  const auto light = [&](double tolerance) {
    FlowSettings settings = single(0.1);
    settings.tolerance = tolerance;
    return caustic_of(bench, map_of(bench, settings)).irradiance.values;
  };
  const std::vector<double> exact = light(0.005);
  std::vector<double> errors;
  for (const double tolerance : {0.8, 0.2, 0.05}) errors.push_back(relative_distance(light(tolerance), exact));
  EXPECT_LT(errors[1], errors[0] / 2);
  EXPECT_LT(errors[2], errors[1] / 3);
  EXPECT_LT(errors[2], 0.005);
}

TEST(FlowMap, KeepsToItsNumberOfVertices) {
  const LightBench bench = make_bench(lens, plate_at(2.2, 3, 512));
  for (const std::size_t most : {1u, 100u, 3000u}) {
    FlowSettings settings = single(0.4);
    settings.max_starts = most;
    const FlowMap map = map_of(bench, settings);
    EXPECT_LT(map.starts.size(), 2 * most + 64);  // Vertices in the middles of quads come on top.
    EXPECT_FALSE(map.is_complete);
    EXPECT_NEAR(all_power(caustic_of(bench, map)), 1, 1e-9);
  }
  EXPECT_TRUE(map_of(make_bench(lens, plate_at(2.2, 3, 32)), single(0.1)).is_complete);
}

TEST(FlowMap, BadSettingsAreRefused) {
  const LightBench bench = make_bench(zero, plate_at(2, 3, 8));
  std::vector<FlowSettings> wrong(4, single(0.1));
  wrong[0].flexibilities.clear();
  wrong[1].range = true;
  wrong[2].tolerance = std::nan("");
  wrong[3].max_starts = 0;
  for (const FlowSettings& settings : wrong) EXPECT_THROW(map_of(bench, settings), std::invalid_argument);
}

TEST(FlowMap, CanBeCancelled) {
  const LightBench bench = make_bench(lens, plate_at(2, 3, 64));
  Progress progress;
  progress.cancelled = true;
  EXPECT_THROW(trace_flow_map(bench.field, bench.geometry, bench.beam, {}, single(0.1), progress), Cancelled);
}

// Flow maps whose vertices were traced in earlier runs or by shards, and whose map and light ranks make together: the
// same bits, and hardly a ray more.
/// Without symmetry, so that sums differ with their order.
Matrix3d skew_lens(const Vector3d& at) {
  return lens({1.1 * at.x() + 0.13 * at.y() + 0.07, 0.9 * at.y() - 0.21 * at.x() - 0.05, at.z()});
}

const LightBench& bench() {
  static const LightBench bench = make_bench(skew_lens, plate_at(4, 2.4, 48));
  return bench;
}

FlowMap map_with(FlowSettings settings, Job& job) {
  settings.job = &job;
  settings.is_kept = true;
  return map_of(bench(), settings);
}

Caustic light_with(const FlowMap& map, Ranks* ranks) {
  std::vector<CausticBand> bands = equal_bands(3, 0, static_cast<double>(map.wavelengths - 1));
  for (std::size_t i = 0; i < bands.size(); ++i) {
    bands[i].channel = i;
    bands[i].color = {0.2, 0.3 * static_cast<double>(i), 1};
  }
  return draw_caustic(map, bench().plate(), bands, {3, true, usual_step, ranks}, Progress());
}

void expect_same(const FlowMap& a, const FlowMap& b) {
  EXPECT_TRUE(a.starts == b.starts);
  EXPECT_TRUE(a.ends == b.ends);
  EXPECT_TRUE(a.lengths == b.lengths);
  EXPECT_EQ(a.triangles.size(), b.triangles.size());
  EXPECT_TRUE(light_with(a, nullptr).irradiance.values == light_with(b, nullptr).irradiance.values);
}

/// What a shard keeps, which is as much of a map as it makes.
Results shard_of(const FlowSettings& settings, WorkPart part, std::size_t& rays) {
  Job shard(part);
  shard.is_shard = true;
  rays += map_with(settings, shard).rays;
  EXPECT_EQ(shard.results().size(), 1u);
  return shard.results();
}

TEST(KeptMap, OfShardsIsThatOfOneRun) {
  std::vector<FlowSettings> all{single(0.3), range(0.1, 0.4)};
  all.back().silhouette = false;
  for (const FlowSettings& settings : all) {
    const FlowMap alone = map_of(bench(), settings);
    for (const std::size_t count : {1, 3, 16}) {
      std::size_t rays = 0;
      Results results;
      for (std::size_t index = 0; index < count; ++index)
        for (const auto& each : shard_of(settings, {index, count}, rays)) results.insert(each);
      Job merged({0, count}, results);
      const FlowMap map = map_with(settings, merged);
      expect_same(map, alone);
      EXPECT_EQ(map.rays, 0) << count;
      EXPECT_LE(rays, alone.rays * 3 / 2) << count;  // Those on the borders of blocks are traced by two.
    }
  }
}

TEST(KeptMap, IsNotTracedAgain) {
  const FlowSettings settings = range(0.1, 0.4);
  Job quick, slow;
  map_with(settings, quick);
  EXPECT_TRUE(quick.results().empty());
  slow.interval = 1e-9;
  const FlowMap alone = map_with(settings, slow);
  Job same({}, slow.results());
  const FlowMap map = map_with(settings, same);
  EXPECT_EQ(map.rays, 0u);
  expect_same(map, alone);
  FlowSettings finer = settings, other = range(0.1, 0.5);
  finer.tolerance = 0.25;
  for (const FlowSettings& each : {finer, other}) {
    Job job({}, slow.results());
    EXPECT_EQ(map_with(each, job).rays, map_of(bench(), each).rays);
  }
}

/// What no light does would be an index, or a place, beyond all memory.
TEST(KeptMap, LandingsThatNoLightHasAreRefused) {
  const FlowSettings settings = single(0.3);
  std::size_t rays = 0;
  const Results kept = shard_of(settings, {}, rays);
  const auto map_of_bytes = [&](const std::string& bytes) {
    Job job({}, {{kept.begin()->first, std::make_shared<const std::string>(bytes)}});
    map_with(settings, job);
  };
  const std::string right = *kept.begin()->second;
  // The key of a vertex has 16 bytes.
  constexpr std::size_t landing = 16, end = landing + 2 * sizeof(float);
  for (const int wrong : {ray_end_count, 255}) {
    std::string bytes = right;
    bytes[end] = static_cast<char>(wrong);
    EXPECT_THROW(map_of_bytes(bytes), DamagedArchive) << wrong;
  }
  std::string bytes = right;
  const float infinite = INFINITY;
  std::memcpy(&bytes[landing], &infinite, sizeof infinite);
  bytes[end] = static_cast<char>(RayEnd::plate);
  EXPECT_THROW(map_of_bytes(bytes), DamagedArchive);
  EXPECT_THROW(map_of_bytes(right + "x"), DamagedArchive);
  EXPECT_NO_THROW(map_of_bytes(right));
}

TEST(RankMap, AndItsLightAreThoseOfOneProcess) {
  for (const FlowSettings& settings : {single(0.3), range(0.1, 0.4)}) {
    const FlowMap alone = map_of(bench(), settings);
    const Caustic light = light_with(alone, nullptr);
    for (const std::size_t count : {std::size_t{1}, std::size_t{3}}) {
      std::vector<FlowMap> maps(count);
      Caustic together;
      run_ranks(count, [&](Ranks& ranks) {
        Job job;
        job.ranks = &ranks;
        FlowSettings mine = settings;
        mine.job = &job;
        maps[ranks.rank()] = map_of(bench(), mine);
        Caustic drawn = light_with(maps[ranks.rank()], &ranks);
        if (is_root(&ranks)) together = std::move(drawn);
      });
      std::size_t rays = 0;
      for (const FlowMap& map : maps) {
        expect_same(map, alone);
        rays += map.rays;
      }
      EXPECT_EQ(rays, alone.rays);  // No ray is traced twice.
      EXPECT_TRUE(together.color.values == light.color.values) << count;
      EXPECT_TRUE(together.irradiance.values == light.irradiance.values) << count;
      EXPECT_TRUE(together.power == light.power) << count;
    }
  }
}

TEST(RankMap, OtherWorkIsRefused) {
  StrangeRanks ranks;
  Job job;
  job.ranks = &ranks;
  FlowSettings settings = single(0.3);
  settings.job = &job;
  EXPECT_THROW(map_of(bench(), settings), DamagedArchive);
  EXPECT_THROW(light_with(map_of(bench(), single(0.3)), &ranks), DamagedArchive);
}

}  // namespace
}  // namespace tensorray
