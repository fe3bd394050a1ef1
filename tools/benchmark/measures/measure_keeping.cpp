#include <algorithm>
#include <atomic>
#include <fstream>
#include <vector>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "base/files/temporary_folder.h"
#include "renderer/density/density.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/child.h"
#include "tools/benchmark/support/machine.h"
#include "tools/benchmark/support/repeat.h"

namespace tensorray::benchmark {
namespace {

constexpr double default_interval = 60;  ///< Seconds between checkpoints.

struct KeptJob {
  std::string name;
  Json scene;
  std::string file;  ///< The checkpoint.
};

std::vector<KeptJob> kept_jobs(bool quick) {
  const int side = quick ? 32 : 512, samples = quick ? 16 : 24;
  const double photons = quick ? 2e4 : 1.2e5;
  const Json field = {{"generate", {{"kind", "point_load"}, {"resolution", quick ? 17 : 65}}}, {"scale", 5}};
  return {{fmt::format("path tracing, {}², 32 bands", side),
           {{"field", field},
            {"integrator", {{"type", "path_tracing"}, {"min_samples", samples}, {"max_samples", samples}}},
            {"camera", {{"resolution", {side, side}}}}},
           "picture.png.checkpoint"},
          {fmt::format("photons, {:g} positions, {}²", photons, 2 * side),
           {{"field", field},
            {"light", {{"photons", photons}, {"wavelengths", {{"count", 32}}}}},
            {"receiver", {{"resolution", {2 * side, 2 * side}}}},
            {"integrator", {{"type", "photon_distribution"}, {"density", {{"kind", "gaussian"}}}}}},
           "picture.png.checkpoint"}};
}

/// @param interval  Seconds between checkpoints; 0: none. @return seconds of the whole job.
double seconds_of(const TemporaryFolder& folder, const KeptJob& job, double interval) {
  const auto scene = folder / "scene.json", statistics = folder / "statistics.json";
  std::ofstream(scene) << job.scene;
  const double start = wall_seconds();
  run_program(sibling("tensorray"), {"render", scene.string(), "-o", (folder / "picture.png").string(), "--stats",
                                     statistics.string(), "--checkpoint", std::to_string(interval), "--quiet"});
  return wall_seconds() - start;
}

/// Jobs with a checkpoint every half a second beside jobs without, in turn; and from that, what one takes.
Json measure_checkpoints(const Options& options, const TemporaryFolder& folder) {
  const double often = options.quick ? 0.05 : 0.5;
  const int rounds = options.quick ? 1 : 3;
  Json rows = Json::array();
  for (const KeptJob& job : kept_jobs(options.quick)) {
    std::vector<double> with, without;
    for (int i = 0; i < rounds; ++i) {
      options.announce("keeping: " + job.name);
      without.push_back(seconds_of(folder, job, 0));
      with.push_back(seconds_of(folder, job, often));
    }
    const double least = *std::min_element(without.begin(), without.end());
    const double kept = *std::min_element(with.begin(), with.end());
    const double one = (kept - least) / (kept / often);
    rows.push_back({{"name", job.name},
                    {"seconds", least},
                    {"interval", often},
                    {"seconds_with_checkpoints", kept},
                    {"seconds_of_one", one},
                    {"part_at_default_interval", one / default_interval}});
  }
  return rows;
}

/// Landings as light leaves them: most of them in a few places.
std::vector<DensityPoint> landings(const DensityEstimator& estimator, std::size_t count, int side, int channels) {
  std::vector<DensityPoint> points;
  std::uint64_t state = 1;
  const auto random = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state >> 11) / 9007199254740992.0;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const double radius = random() * random();
    const Eigen::Vector2d at = (0.5 + 0.5 * radius * (2 * random() - 1)) * Eigen::Vector2d(side, side) +
                               0.25 * side * Eigen::Vector2d(random() - 0.5, random() - 0.5);
    points.push_back(
        estimator.point(static_cast<int>(i) % channels, at.cwiseMax(0).cwiseMin(static_cast<double>(side))));
  }
  return points;
}

/// Photons of a chunk, summed in the order of the photons, beside the same sums in any order, with atomic additions.
/// @return seconds for a photon, of both.
std::pair<double, double> measure_sums(const Options& options) {
  const int side = 1024, channels = 32;
  const std::size_t count = options.quick ? 1u << 12 : 1u << 20;
  const std::vector<Eigen::Vector3d> colors(channels, Eigen::Vector3d(0.3, 0.5, 0.2));
  DensityEstimator estimator(side, side, channels, {DensityKind::histogram, 6, 1}, colors);
  const std::vector<DensityPoint> points = landings(estimator, count, side, channels);
  const auto in_order = [&](std::uint64_t rounds) {
    for (std::uint64_t i = 0; i < rounds; ++i) estimator.add(points);
    return rounds * count;
  };
  std::vector<std::atomic<float>> sums(static_cast<std::size_t>(3) * (side + 1) * (side + 1));
  const auto in_any_order = [&](std::uint64_t rounds) {
    for (std::uint64_t round = 0; round < rounds; ++round)
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 4096), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          const std::size_t pixel = 3 * (static_cast<std::size_t>(points[i].row) * side + points[i].column);
          for (std::size_t color = 0; color < 3; ++color) {
            std::atomic<float>& sum = sums[pixel + color];
            float before = sum.load(std::memory_order_relaxed);
            while (!sum.compare_exchange_weak(before, before + 0.3f, std::memory_order_relaxed)) {
            }
          }
        }
      });
    return rounds * count;
  };
  const double seconds = options.quick ? 0.01 : 1;
  return {1 / repeat(as_many, in_order, wall_seconds, seconds).median,
          1 / repeat(as_many, in_any_order, wall_seconds, seconds).median};
}

/// What fixed orders cost, as a part of a job of photons: other methods have none, or sum integers, which take as long
/// as numbers of double precision.
Json measure_determinism(const Options& options, const TemporaryFolder& folder) {
  options.announce("keeping: sums in a fixed order");
  const auto [ordered, unordered] = measure_sums(options);
  const KeptJob job = kept_jobs(options.quick).back();
  seconds_of(folder, job, 0);
  std::ifstream file(folder / "statistics.json");
  const Json statistics = Json::parse(file);
  const double photons = statistics.at("photons").at("emitted"), seconds = statistics.at("seconds").at("total");
  return {{"job", job.name},
          {"seconds_of_photon_in_order", ordered},
          {"seconds_of_photon_in_any_order", unordered},
          {"seconds", seconds},
          {"part", std::max(0.0, ordered - unordered) * photons / seconds},
          {"most", ordered * photons / seconds}};
}

}  // namespace

Json measure_keeping(const Options& options) {
  const TemporaryFolder folder;
  Json checkpoints = measure_checkpoints(options, folder);
  return {{"checkpoints", checkpoints}, {"determinism", measure_determinism(options, folder)}};
}

}  // namespace tensorray::benchmark
