/// Rows of a picture of 1024² pixels through 65³ voxels, on one thread: what the field's samples alone take, and the
/// light of 32 bands.

#include <filesystem>

#include <benchmark/benchmark.h>

#include "integrators/methods/read_scene.h"
#include "integrators/polariscope/load_polariscope.h"
#include "scenes/scene/scene.h"
#include "tools/benchmark/questions.h"

namespace tensorray::bench {
namespace {

constexpr int rows = 32;

void trace_rows(benchmark::State& state, const char* direction, bool all_bands) {
  const std::vector<std::string> settings{std::string("light.direction=") + direction, "receiver.resolution=1024"};
  const Scene scene = load_scene(
      read_scene(std::filesystem::path(TENSORRAY_SCENES) / "point_load_polariscope.json", {settings, {}}), Progress());
  std::vector<std::string> notes;
  PolarizedLight light = load_polariscope(scene, {}, notes).light;
  if (!all_bands) light.bands.clear();
  const PolarTracer tracer(scene.field, scene.geometry, light, *scene.geometry.surfaces().plate);
  for (auto _ : state)
    for (int row = 0; row < rows; ++row) benchmark::DoNotOptimize(tracer.row(row * (1024 / rows) + 7));
  state.counters["rays_per_second"] = {4.0 * 1024 * rows * static_cast<double>(state.iterations()),
                                       benchmark::Counter::kIsRate};
}

}  // namespace

void add_polariscope() {
  for (const auto& [name, direction] : {std::pair("along_an_axis", "[0,1,0]"), std::pair("oblique", "[0.3,1,0.2]")})
    for (const bool all_bands : {false, true}) {
      const std::string title = std::string("polariscope/") + name + (all_bands ? "/32_bands" : "/field_samples");
      const auto run = [=, from = direction](benchmark::State& state) { trace_rows(state, from, all_bands); };
      benchmark::RegisterBenchmark(title.c_str(), run)->Unit(benchmark::kMillisecond);
    }
}

}  // namespace tensorray::bench
