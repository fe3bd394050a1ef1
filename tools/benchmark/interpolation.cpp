/// @file tools/benchmark/interpolation.cpp
/// The error of a picture that is made from few voxels: against that of 257³ voxels of the same formula, at 550 nm, as
/// the root mean square of the difference, as a part of the picture's root mean square.

#include <map>
#include <string>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "renderer/film/spectral_image.h"
#include "renderer/images/image.h"
#include "tools/benchmark/questions.h"
#include "tools/benchmark/run_render.h"

namespace tensorray::bench {
namespace {

Json scene_of(const Json& generate, const Json& field, const Json& light, const Json& plate) {
  Json scene = {{"field", field}, {"light", light}, {"receiver", plate}};
  scene["field"]["generate"] = generate;
  scene["light"].update({{"photons", 1 << 24}, {"wavelengths", {{"min", 550}, {"max", 551}, {"count", 1}}}});
  scene["receiver"].update({{"size", {3.2, 3.2}}, {"resolution", {512, 512}}});
  scene["integrator"] = {{"type", "photon_distribution"}, {"density", {{"tolerance", 0.1}}}};
  return scene;
}

/// A load in light that passes below it: it is singular where it acts, and the box ends a voxel below.
Json load(const Json& generate) {
  return scene_of(generate, {{"eigenvalues", "raw"}, {"scale", 8}},
                  {{"direction", {0, 1, 0}}, {"aperture", {{"center", {0, -1, -1}}, {"size", {1.6, 1.2}}}}},
                  {{"center", {0, 2, -1}}});
}

std::map<std::string, Json> scenes() {
  return {{"vortex", scene_of({{"kind", "vortex"}}, {{"eigenvalues", "raw"}, {"scale", 0.75}},
                              {{"direction", {0, 1, -0.5}}}, Json::object())},
          {"helix", scene_of({{"kind", "helix"}}, {{"eigenvalues", "absolute"}, {"scale", 4}},
                             {{"direction", {0, 1, 0}}}, Json::object())},
          {"two_point_load", load({{"kind", "two_point_load"}})},
          {"point_load", load({{"kind", "point_load"}})},
          {"load_on_a_disc", load({{"kind", "point_load"}, {"radius", 0.3}})}};
}

Image picture_of(Json scene, int voxels, const std::string& interpolation, benchmark::State& state) {
  const TemporaryFolder folder;
  scene["field"]["generate"]["resolution"] = voxels;
  scene["field"]["interpolation"] = interpolation;
  const Json statistics = run_render(folder, scene, {"picture.exr"});
  state.SetIterationTime(statistics.at("seconds").at("trace"));
  return read_image(folder / "picture.exr");
}

void measure(benchmark::State& state, const std::string& name, const Json& scene, int voxels,
             const std::string& interpolation) {
  static std::map<std::string, Image> exact;  // Made where it is first needed.
  for (auto _ : state) {
    if (exact.count(name) == 0) exact[name] = picture_of(scene, 257, "cubic", state);
    const Image picture = picture_of(scene, voxels, interpolation, state);
    state.counters["error"] = relative_distance(picture, exact[name]);
  }
}

}  // namespace

void add_interpolation() {
  for (const auto& [name, scene] : scenes())
    for (const int voxels : {33, 65, 129})
      for (const std::string interpolation : {"linear", "cubic"}) {
        const auto run = [name = name, scene = scene, voxels, interpolation](benchmark::State& state) {
          measure(state, name, scene, voxels, interpolation);
        };
        benchmark::RegisterBenchmark(fmt::format("interpolation/{}_{}/{}", name, voxels, interpolation).c_str(), run)
            ->Iterations(1)
            ->UseManualTime()
            ->Unit(benchmark::kSecond);
      }
}

}  // namespace tensorray::bench
