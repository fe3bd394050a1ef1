#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "base/files/temporary_folder.h"
#include "renderer/film/image_distance.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/child.h"
#include "tools/benchmark/support/machine.h"

namespace tensorray::benchmark {
namespace {

struct CausticScene {
  const char* name;
  Json scene;
};

CausticScene generated(const char* name, const Json& field, const Json& direction) {
  return {name, {{"field", field}, {"light", {{"direction", direction}}}, {"receiver", Json::object()}}};
}

std::vector<CausticScene> scenes(const Options& options) {
  const Json point_load = {{"generate", {{"kind", "point_load"}, {"resolution", options.quick ? 17 : 65}}},
                           {"eigenvalues", "absolute"}};
  if (options.quick) return {generated("point load", point_load, {0, 0, -1})};
  const std::filesystem::path folder = TENSORRAY_SCENES;
  std::vector<CausticScene> result = {generated("point load", point_load, {0, 0, -1}),
                                      generated("vortex", {{"generate", {{"kind", "vortex"}}}}, {0, 1, 0}),
                                      generated("helix", {{"generate", {{"kind", "helix"}}}}, {0, 0, -1})};
  result.push_back({"hemisphere flow",
                    {{"field", {{"file", folder / "data/hemisphere_flow.vdb"}, {"eigenvalues", "raw"}, {"scale", 2}}},
                     {"obstacles", {{{"file", folder / "data/hemisphere_body.ply"}}}},
                     {"light", {{"direction", {1, 0, 0}}, {"up", {0, 0, 1}}}},
                     {"receiver", {{"distance", 1}, {"size", {7.2, 7.2}}}}}});
  const std::filesystem::path brain = folder / "imported/brain.vdb";  // scenes/imported/brain.json tells how to get it.
  if (!exists(brain)) {
    options.announce("caustics: no brain, as " + brain.string() + " is not there");
    return result;
  }
  result.push_back({"brain",
                    {{"field", {{"file", brain}, {"scale", 80}}},
                     {"light", {{"direction", {0, 0, 1}}, {"up", {0, 1, 0}}}},
                     {"receiver", {{"distance", 40}}}}});
  return result;
}

/// One way to compute the light on the plate.
struct Estimate {
  std::string name;
  Json density;
  std::uint64_t photons = 1u << 20;
};

std::vector<Estimate> estimates(bool quick) {
  std::vector<Estimate> result{{"mesh", {{"kind", "mesh"}}},
                               {"mesh, error 5%", {{"kind", "mesh"}, {"error", 0.05}}, 1u << 22}};
  const std::vector<std::uint64_t> counts =
      quick ? std::vector<std::uint64_t>{1024} : std::vector<std::uint64_t>{16384, 65536, 262144};
  for (const std::uint64_t photons : counts) {
    result.push_back({"photon differentials", {{"kind", "photon_differential"}}, photons});
    for (const double tau : {3.0, 1.0, 0.0}) {
      Json density = {{"kind", "gaussian"}, {"tau", tau}};
      if (tau == 0) density = {{"kind", "histogram"}};
      result.push_back({tau == 0 ? "histogram" : fmt::format("gaussian, τ = {}", tau), density, photons});
    }
  }
  return result;
}

struct Picture {
  Image image;
  Json statistics;
};

Picture render(const TemporaryFolder& folder, const CausticScene& scene, const Estimate& estimate, int side) {
  const auto path = folder / "scene.json", picture = folder / "picture.exr", statistics = folder / "statistics.json";
  Json json = scene.scene;
  json["light"]["photons"] = estimate.photons;
  json["receiver"]["resolution"] = {side, side};
  json["integrator"] = {{"type", "photon_distribution"}, {"density", estimate.density}};
  std::ofstream(path) << json;
  run_program(sibling("tensorray"), {"render", path.string(), "-o", picture.string(), "-o",
                                     (folder / "picture.png").string(), "--stats", statistics.string(), "--quiet"});
  std::ifstream file(statistics);
  return {read_image(picture), Json::parse(file)};
}

/// Whether the light of a pixel differs from that of each of its neighbours by less than a tenth of the mean: there is
/// no fold and no singular line.
std::vector<bool> even_pixels(const Image& exact) {
  const auto light = [&](int x, int y) {
    const float* const pixel = exact.pixel(x, y);
    return pixel[0] + pixel[1] + pixel[2];
  };
  double mean = 0;
  for (int y = 0; y < exact.height; ++y)
    for (int x = 0; x < exact.width; ++x) mean += light(x, y) / (double(exact.width) * exact.height);
  std::vector<bool> is_even(static_cast<std::size_t>(exact.width) * exact.height, true);
  for (int y = 0; y < exact.height; ++y)
    for (int x = 0; x < exact.width; ++x)
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, exact.height - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, exact.width - 1); ++u)
          if (std::abs(light(u, v) - light(x, y)) > 0.1 * mean)
            is_even[static_cast<std::size_t>(y) * exact.width + x] = false;
  return is_even;
}

/// The picture, black where `keeps` is false.
Image parts_of(Image image, const std::vector<bool>& keeps) {
  const std::size_t channels = image.channels.size();
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    if (!keeps[i / channels]) image.pixels[i] = 0;
  return image;
}

Json row_of(const Estimate& estimate, const Picture& picture, const Image& exact, const std::vector<bool>& is_even) {
  const Json& seconds = picture.statistics.at("seconds");
  Json row = {{"name", estimate.name},
              {"positions", picture.statistics.at("positions")},
              {"seconds", seconds.at("total")},
              {"seconds_of_light", seconds.at("trace").get<double>() + seconds.at("density").get<double>()},
              {"error", relative_distance(picture.image, exact)},
              {"even_error", relative_distance(parts_of(picture.image, is_even), parts_of(exact, is_even))}};
  if (picture.statistics.contains("error")) row["estimate"] = picture.statistics.at("error");
  return row;
}

/// How many times longer the best of the photon estimators takes than the first row, for the error of the first row. An
/// estimator that does not reach this error gets more photons, if its error still falls: its noise falls with their
/// square root. 0: none reaches it.
double slowdown_of_photons(const Json& rows) {
  const double error = rows[0].at("error"), seconds = rows[0].at("seconds_of_light");
  double best = std::numeric_limits<double>::infinity();
  for (const Json& row : rows) {
    const std::string name = row.at("name");
    if (name.rfind("mesh", 0) == 0) continue;
    const double factor = std::pow(row.at("error").get<double>() / error, 2);
    if (factor <= 1 || name == "histogram")
      best = std::min(best, std::max(factor, 1.0) * row.at("seconds_of_light").get<double>());
  }
  return std::isfinite(best) ? best / seconds : 0;
}

}  // namespace

Json measure_caustics(const Options& options) {
  const TemporaryFolder folder;
  const int side = options.quick ? 32 : 512;
  Json results = Json::array();
  for (const CausticScene& scene : scenes(options)) {
    if (std::string(scene.name).find(options.field) == std::string::npos) continue;
    options.announce(fmt::format("caustics: {}, reference", scene.name));
    const Json exact_density = {{"kind", "mesh"}, {"error", options.quick ? 0.005 : 0.01}};
    const Image exact = render(folder, scene, {"reference", exact_density, 1u << 23}, side).image;
    const std::vector<bool> is_even = even_pixels(exact);
    const double even_part = static_cast<double>(std::count(is_even.begin(), is_even.end(), true)) / (side * side);
    Json rows = Json::array();
    for (const Estimate& estimate : estimates(options.quick)) {
      options.announce(fmt::format("caustics: {}, {}", scene.name, estimate.name));
      rows.push_back(row_of(estimate, render(folder, scene, estimate, side), exact, is_even));
    }
    const double slowdown = slowdown_of_photons(rows);
    results.push_back({{"scene", scene.name}, {"side", side}, {"even_part", even_part}, {"rows", std::move(rows)}});
    if (slowdown > 0) results.back()["photons_over_mesh"] = slowdown;
  }
  return results;
}

}  // namespace tensorray::benchmark
