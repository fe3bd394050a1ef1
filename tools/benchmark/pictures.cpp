/// @file tools/benchmark/pictures.cpp
/// Seconds from scene file to picture of each method, by phase, on one thread and on all; and what checkpoints cost.

#include <string>
#include <thread>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "base/process/seconds.h"
#include "integrators/polariscope/differences.h"
#include "tools/benchmark/questions.h"
#include "tools/benchmark/run_render.h"
#include "volumes/making/generators.h"

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
      {"polariscope_1024",
       {{"light", {{"direction", {0, 1, 0}}, {"up", {0, 0, 1}}}},
        {"receiver", {{"resolution", {1024, 1024}}}},
        {"integrator", {{"type", "polariscope"}}}},
       {"picture.png"}},
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

/// What the picture of the polariscope cannot do without: on all threads, two samples a voxel along 2 × 2 rays a pixel.
void sample_alone(benchmark::State& state) {
  constexpr int rays = 2 * 1024, voxels = 64, packet = 32;
  const TensorField field(generate(PointLoad(), GridSettings{{voxels, voxels, voxels}}), {Interpolation::cubic});
  for (auto _ : state) {
    const auto start = Clock::now();
    tbb::parallel_for(0, rays, [&](int z) {
      DifferenceSampler sampler(field, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), 1);
      std::vector<Eigen::Vector3d> points(2 * packet);
      std::vector<float> a, b;
      for (int x = 0; x < rays; x += packet)
        for (int step = 0; step < voxels - 1; ++step) {
          for (int p = 0; p < 2 * packet; ++p)
            points[static_cast<std::size_t>(p)] = Eigen::Vector3d(x + p % packet, 0, z) * (voxels - 1) / rays +
                                                  Eigen::Vector3d(0, step + (p < packet ? 0.2 : 0.8), 0);
          sampler.sample(points, a, b);
        }
    });
    state.SetIterationTime(seconds_since(start));
  }
}

}  // namespace

void add_pictures() {
  const std::string all = std::to_string(std::thread::hardware_concurrency());
  for (const int resolution : {64, 256})
    for (const Picture& picture : pictures_of(resolution)) {
      add(picture, "1_thread", {"--threads", "1"});
      add(picture, "all_threads", {"--threads", all});
    }
  benchmark::RegisterBenchmark("pictures/polariscope_1024_of_64_voxels/samples_alone", sample_alone)
      ->Iterations(1)
      ->UseManualTime()
      ->Unit(benchmark::kSecond);
  const Picture kept{"kept",
                     {{"field", {{"generate", {{"kind", "point_load"}}}, {"scale", 5}}},
                      {"integrator", {{"type", "path_tracing"}, {"min_samples", 24}, {"max_samples", 24}}},
                      {"camera", {{"resolution", {512, 512}}}}}};
  add(kept, "without_checkpoints", {"--checkpoint", "0"});
  add(kept, "one_each_half_second", {"--checkpoint", "0.5"});
}

}  // namespace tensorray::bench
