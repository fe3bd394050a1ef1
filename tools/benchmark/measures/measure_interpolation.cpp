#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include <fmt/format.h>

#include "base/files/temporary_folder.h"
#include "renderer/film/image_distance.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/child.h"

namespace tensorray::benchmark {
namespace {

/// A field that is known everywhere, and light of one wavelength through it.
struct KnownField {
  const char* name;
  Json generate, eigenvalues;
  double scale;
  Json light, plate;
};

KnownField wholly_lit(const char* name, const char* kind, const Json& eigenvalues, double scale,
                      const Json& direction) {
  return {name, {{"kind", kind}}, eigenvalues, scale, {{"direction", direction}}, Json::object()};
}

/// A load in light that passes below it: it is singular where it acts, and the box ends a voxel below. Eigenvalues
/// without their signs would draw the light up there.
KnownField load(const char* name, Json generate) {
  return {name,
          std::move(generate),
          "raw",
          8,
          {{"direction", {0, 1, 0}}, {"aperture", {{"center", {0, -1, -1}}, {"size", {1.6, 1.2}}}}},
          {{"center", {0, 2, -1}}}};
}

std::vector<KnownField> fields() {
  return {wholly_lit("vortex", "vortex", "raw", 0.75, {0, 1, -0.5}),
          wholly_lit("helix", "helix", "absolute", 4, {0, 1, 0}), load("two-point load", {{"kind", "two_point_load"}}),
          load("point load", {{"kind", "point_load"}}),
          load("load on a disc", {{"kind", "point_load"}, {"radius", 0.3}})};
}

/// How a field is sampled and followed.
struct Variant {
  std::string name;
  int voxels;
  Json interpolation, method = "auto", step = "auto";
};

Json scene_of(const KnownField& field, const Variant& variant, double tolerance, int side) {
  Json generate = field.generate;
  generate["resolution"] = variant.voxels;
  Json light = field.light, plate = field.plate;
  light.update({{"photons", 1u << 24}, {"wavelengths", {{"min", 550}, {"max", 551}, {"count", 1}}}});
  plate.update({{"size", {3.2, 3.2}}, {"resolution", {side, side}}});
  return {{"field",
           {{"generate", generate},
            {"eigenvalues", field.eigenvalues},
            {"scale", field.scale},
            {"interpolation", variant.interpolation}}},
          {"bending", {{"method", variant.method}, {"step", variant.step}}},
          {"light", light},
          {"receiver", plate},
          {"integrator", {{"type", "photon_distribution"}, {"density", {{"kind", "mesh"}, {"tolerance", tolerance}}}}}};
}

struct Picture {
  Image image;
  Json statistics;
};

Picture render(const TemporaryFolder& folder, const Json& scene) {
  const auto path = folder / "scene.json", picture = folder / "picture.exr", statistics = folder / "statistics.json";
  std::ofstream(path) << scene;
  run_program(sibling("tensorray"),
              {"render", path.string(), "-o", picture.string(), "--stats", statistics.string(), "--quiet"});
  std::ifstream file(statistics);
  return {read_image(picture), Json::parse(file)};
}

std::vector<Variant> variants(bool quick) {
  std::vector<Variant> result;
  for (const int voxels : quick ? std::vector<int>{9} : std::vector<int>{33, 65, 129})
    for (const char* between : {"linear", "cubic"})
      result.push_back({fmt::format("{}³, {}", voxels, between), voxels, between});
  if (quick) return result;
  for (const double step : {0.5, 1.0})
    result.push_back({fmt::format("33³, cubic, splitting, step {}", step), 33, "cubic", "splitting", step});
  for (const double step : {2.0, 4.0, 6.0})
    result.push_back({fmt::format("33³, cubic, splitting4, step {}", step), 33, "cubic", "splitting4", step});
  return result;
}

}  // namespace

Json measure_interpolation(const Options& options) {
  const TemporaryFolder folder;
  const int side = options.quick ? 32 : 512;
  const double fine = options.quick ? 0.5 : 0.1;
  Json results = Json::array();
  for (const KnownField& field : fields()) {
    if (std::string(field.name).find(options.field) == std::string::npos) continue;
    options.announce(fmt::format("interpolation: {}, reference", field.name));
    const Variant reference{"257³, cubic", options.quick ? 17 : 257, "cubic", "splitting4", 2};
    const Image exact = render(folder, scene_of(field, reference, fine / 2, side)).image;
    Json rows = Json::array();
    for (const Variant& variant : variants(options.quick)) {
      options.announce(fmt::format("interpolation: {}, {}", field.name, variant.name));
      const Picture converged = render(folder, scene_of(field, variant, fine, side));
      const Picture usual = render(folder, scene_of(field, variant, 0.5, side));
      rows.push_back({{"name", variant.name},
                      {"error", relative_distance(converged.image, exact)},
                      {"usual_error", relative_distance(usual.image, exact)},
                      {"seconds", usual.statistics.at("seconds").at("trace")},
                      {"samples", usual.statistics.at("tensor_samples")}});
    }
    results.push_back({{"field", field.name}, {"side", side}, {"rows", std::move(rows)}});
  }
  return results;
}

}  // namespace tensorray::benchmark
