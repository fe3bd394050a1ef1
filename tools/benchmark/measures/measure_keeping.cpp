#include <algorithm>
#include <fstream>
#include <vector>

#include <fmt/format.h>

#include "base/files/temporary_folder.h"
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

}  // namespace

Json measure_keeping(const Options& options) {
  const TemporaryFolder folder;
  return {{"checkpoints", measure_checkpoints(options, folder)}};
}

}  // namespace tensorray::benchmark
