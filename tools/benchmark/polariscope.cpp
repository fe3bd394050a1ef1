/// @file tools/benchmark/polariscope.cpp
/// Rows of a picture of 1024² pixels through 65³ voxels, on one thread: what the field's samples alone take, and the
/// light of 32 bands.

#include <filesystem>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "integrators/methods/read_scene.h"
#include "integrators/polariscope/load_polariscope.h"
#include "scenes/scene/scene.h"
#include "tools/benchmark/questions.h"

namespace tensorray::bench {
namespace {

constexpr int pixels = 1024, rows = 32;

void trace_rows(benchmark::State& state, const std::string& direction, int samples, bool all_bands) {
  const std::vector<std::string> settings{"light.direction=" + direction, "receiver.resolution=1024",
                                          fmt::format("integrator.samples={}", samples)};
  const Scene scene = load_scene(
      read_scene(std::filesystem::path(TENSORRAY_SCENES) / "point_load_polariscope.json", {settings, {}}), Progress());
  std::vector<std::string> notes;
  PolariscopeDescription description;
  description.samples = samples;
  PolarizedLight light = load_polariscope(scene, description, notes).light;
  if (!all_bands) light.bands.clear();
  const PolarTracer tracer(scene.field, scene.geometry, light, *scene.geometry.surfaces().plate);
  for (auto _ : state)
    for (int row = 0; row < rows; ++row) benchmark::DoNotOptimize(tracer.row(row * (pixels / rows) + 7));
  const double rays = static_cast<double>(state.iterations()) * rows * pixels * samples * samples;
  state.counters["rays_per_second"] = {rays, benchmark::Counter::kIsRate};
}

}  // namespace

void add_polariscope() {
  for (const auto& [name, direction] : {std::pair("along_an_axis", "[0,1,0]"), std::pair("oblique", "[0.3,1,0.2]")})
    for (const int samples : {1, 2})
      for (const bool all_bands : {false, true}) {
        const auto run = [=, from = std::string(direction)](benchmark::State& state) {
          trace_rows(state, from, samples, all_bands);
        };
        benchmark::RegisterBenchmark(fmt::format("polariscope/{}_{}x{}_samples/{}", name, samples, samples,
                                                 all_bands ? "32_bands" : "field_samples")
                                         .c_str(),
                                     run)
            ->Unit(benchmark::kMillisecond);
      }
}

}  // namespace tensorray::bench
