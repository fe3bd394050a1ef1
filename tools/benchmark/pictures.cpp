/// @file tools/benchmark/pictures.cpp
/// Seconds from scene file to picture of each method, by phase, on one thread and on all; and what checkpoints cost.

#include <string>
#include <thread>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "tools/benchmark/questions.h"
#include "tools/benchmark/run_render.h"

namespace tensorray::bench {
namespace {

struct Picture {
  std::string name;
  Json scene;
  std::vector<std::string> outputs{"picture.png", "picture.exr"};
};

/// Of a point load of `n`³ voxels. Larger fields get fewer rays, so that a picture takes a few seconds.
std::vector<Picture> pictures_of(int n) {
  const int photons = 4194304 / n, side = std::min(256, 32768 / n);
  const Json size = {side, side};
  std::vector<Picture> pictures{
      {fmt::format("plate_{}_positions", photons),
       {{"light", {{"photons", photons}}},
        {"receiver", {{"resolution", {1024, 1024}}}},
        {"integrator", {{"type", "photon_distribution"}, {"density", {{"kind", "gaussian"}}}}}}},
      {"flow_map_1024",
       {{"receiver", {{"resolution", {1024, 1024}}}}, {"integrator", {{"type", "photon_distribution"}}}}},
      {fmt::format("lens_{}", side),
       {{"receiver", {{"resolution", size}}}, {"integrator", {{"type", "lens"}, {"mode", "gather"}}}}},
      {"1000_tubes_256",
       {{"camera", {{"resolution", {256, 256}}}},
        {"integrator", {{"type", "path_tracing"}, {"seeds", {{"count", 1000}}}}}}},
      {"200000_paths", {{"integrator", {{"type", "path_tracing"}, {"seeds", {{"count", 200000}}}}}}, {"paths.tck"}},
  };
  for (Picture& picture : pictures) {
    picture.scene["field"] = {{"generate", {{"kind", "point_load"}, {"resolution", n}}}, {"eigenvalues", "raw"}};
    picture.name += fmt::format("_of_{}_voxels", n);
  }
  return pictures;
}

void render(benchmark::State& state, const Picture& picture, const std::vector<std::string>& options) {
  const TemporaryFolder folder;
  for (auto _ : state) {
    const Json statistics = run_render(folder, picture.scene, picture.outputs, options);
    for (const auto& [phase, seconds] : statistics.at("seconds").items())
      if (phase != "total" && seconds > 0.005) state.counters[phase] = seconds.get<double>();
    state.SetIterationTime(statistics.at("seconds").at("total"));
  }
}

void add(const Picture& picture, const std::string& way, const std::vector<std::string>& options) {
  const auto run = [picture, options](benchmark::State& state) { render(state, picture, options); };
  benchmark::RegisterBenchmark(("pictures/" + picture.name + "/" + way).c_str(), run)
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kSecond);
}

}  // namespace

void add_pictures() {
  const std::string all = std::to_string(std::thread::hardware_concurrency());
  for (const int resolution : {64, 256})
    for (const Picture& picture : pictures_of(resolution)) {
      add(picture, "1_thread", {"--threads", "1"});
      add(picture, "all_threads", {"--threads", all});
    }
  const Picture kept{"kept",
                     {{"field", {{"generate", {{"kind", "point_load"}}}, {"scale", 5}}},
                      {"integrator", {{"type", "path_tracing"}, {"min_samples", 24}, {"max_samples", 24}}},
                      {"camera", {{"resolution", {512, 512}}}}}};
  add(kept, "without_checkpoints", {"--checkpoint", "0"});
  add(kept, "one_each_half_second", {"--checkpoint", "0.5"});
}

}  // namespace tensorray::bench
