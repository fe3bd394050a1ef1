/// @file tools/benchmark/caustics.cpp
/// The error of the light on a plate, and the time for it, of the flow map and of photons. An error is the root mean
/// square of the difference to a map whose own estimate is below 1%, as a part of the picture's root mean square.

#include <filesystem>
#include <map>
#include <string>

#include <benchmark/benchmark.h>

#include "renderer/film/spectral_image.h"
#include "renderer/images/image.h"
#include "tools/benchmark/questions.h"
#include "tools/benchmark/run_render.h"

namespace tensorray::bench {
namespace {

const std::filesystem::path scenes = TENSORRAY_SCENES;

Json scene_of(const Json& field, const Json& direction) {
  return {{"field", field}, {"light", {{"direction", direction}}}, {"receiver", Json::object()}};
}

std::map<std::string, Json> fields() {
  const Json point_load = {{"generate", {{"kind", "point_load"}}}, {"eigenvalues", "absolute"}};
  const Json flow = {{"file", scenes / "data/hemisphere_flow.vdb"}, {"eigenvalues", "raw"}, {"scale", 2}};
  std::map<std::string, Json> all{
      {"point_load", scene_of(point_load, {0, 0, -1})},
      {"vortex", scene_of({{"generate", {{"kind", "vortex"}}}}, {0, 1, 0})},
      {"helix", scene_of({{"generate", {{"kind", "helix"}}}}, {0, 0, -1})},
      {"hemisphere_flow", scene_of(flow, {1, 0, 0})},
      // scenes/imported/brain.json tells how to get it.
      {"brain", scene_of({{"file", scenes / "imported/brain.vdb"}, {"scale", 80}}, {0, 0, 1})},
  };
  Json& hemisphere = all["hemisphere_flow"];
  hemisphere["obstacles"] = {{{"file", scenes / "data/hemisphere_body.ply"}}};
  hemisphere["light"]["up"] = {0, 0, 1};
  hemisphere["receiver"] = {{"distance", 1}, {"size", {7.2, 7.2}}};
  all["brain"]["light"]["up"] = {0, 1, 0};
  all["brain"]["receiver"] = {{"distance", 40}};
  return all;
}

struct Estimate {
  const char* name;
  Json density;
  double photons = 262144;
};

const Estimate exact{"exact", {{"kind", "mesh"}, {"error", 0.01}}, 1 << 23};
const std::vector<Estimate> estimates{{"mesh", {{"kind", "mesh"}}, 1 << 20},
                                      {"mesh_of_5_percent", {{"kind", "mesh"}, {"error", 0.05}}, 1 << 22},
                                      {"photon_differentials", {{"kind", "photon_differential"}}},
                                      {"gaussian_of_3_pixels", {{"kind", "gaussian"}, {"tau", 3}}},
                                      {"gaussian_of_1_pixel", {{"kind", "gaussian"}, {"tau", 1}}},
                                      {"histogram", {{"kind", "histogram"}}}};

Image picture_of(const TemporaryFolder& folder, Json scene, const Estimate& estimate, Json& statistics) {
  scene["light"]["photons"] = estimate.photons;
  scene["receiver"]["resolution"] = {512, 512};
  scene["integrator"] = {{"type", "photon_distribution"}, {"density", estimate.density}};
  statistics = run_render(folder, scene, {"picture.exr"});
  return read_image(folder / "picture.exr");
}

/// Made where an estimate is first compared with it.
const Image& exact_picture(const TemporaryFolder& folder, const std::string& field, const Json& scene) {
  static std::map<std::string, Image> made;
  Json unused;
  if (made.count(field) == 0) made[field] = picture_of(folder, scene, exact, unused);
  return made[field];
}

void measure(benchmark::State& state, const std::string& field, const Json& scene, const Estimate& estimate) {
  if (scene["field"].contains("file") && !exists(scene["field"]["file"].get<std::filesystem::path>()))
    return state.SkipWithError("the field's file is not there");
  const TemporaryFolder folder;
  for (auto _ : state) {
    Json statistics;
    const Image picture = picture_of(folder, scene, estimate, statistics);
    const Json& seconds = statistics.at("seconds");
    state.SetIterationTime(seconds.at("trace").get<double>() + seconds.at("density").get<double>());
    state.counters["positions"] = statistics.at("positions").get<double>();
    state.counters["error_percent"] = 100 * relative_distance(picture, exact_picture(folder, field, scene));
    if (statistics.contains("error")) state.counters["estimate_percent"] = 100 * statistics["error"].get<double>();
  }
}

}  // namespace

void add_caustics() {
  for (const auto& [field, scene] : fields())
    for (const Estimate& estimate : estimates) {
      const auto run = [field = field, scene = scene, &estimate](benchmark::State& state) {
        measure(state, field, scene, estimate);
      };
      benchmark::RegisterBenchmark(("caustics/" + field + "/" + estimate.name).c_str(), run)
          ->Iterations(1)
          ->UseManualTime()
          ->Unit(benchmark::kSecond);
    }
}

}  // namespace tensorray::bench
