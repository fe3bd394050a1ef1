/// @file tools/benchmark/loading.cpp
/// Seconds from a VDB file, which the system has in memory, to the field of a render.

#include <string>

#include <benchmark/benchmark.h>

#include "tools/benchmark/questions.h"
#include "tools/benchmark/run_render.h"

namespace tensorray::bench {
namespace {

void load(benchmark::State& state, const std::string& resolution) {
  const TemporaryFolder folder;
  run_program(folder, {"make", "point_load", "--resolution", resolution, "-o", "field.vdb"});
  const Json scene = {{"field", {{"file", "field.vdb"}, {"scale", 1}, {"eigenvalues", "raw"}}},
                      {"light", {{"photons", 64}}},
                      {"receiver", {{"resolution", {8, 8}}}},
                      {"integrator", {{"type", "photon_distribution"}, {"density", {{"kind", "histogram"}}}}}};
  for (auto _ : state) state.SetIterationTime(run_render(folder, scene, {"picture.exr"}).at("seconds").at("load"));
}

}  // namespace

void add_loading() {
  for (const std::string resolution : {"64", "256"}) {
    const auto run = [resolution](benchmark::State& state) { load(state, resolution); };
    benchmark::RegisterBenchmark(("loading/" + resolution + "_voxels/vdb").c_str(), run)
        ->UseManualTime()
        ->Unit(benchmark::kSecond);
  }
}

}  // namespace tensorray::bench
