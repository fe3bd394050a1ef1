// A scene in another unit of length is the same picture: nothing in a render has a length of its own.

#include <map>
#include <set>

#include <fmt/format.h>

#include "base/process/progress.h"
#include "integrators/methods/read_scene.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tests/names.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

/// Channels of pictures that are lengths.
const std::set<std::string> lengths{"displacement.x", "displacement.y", "displacement.z", "length", "Z"};

/// A scene without its field. `$5` is the length 5.
struct SceneCase {
  std::string name, text;
  int greatest = 86;  ///< Exponent of the greatest unit, 2^86 = 8e25.
};

const std::vector<SceneCase> scenes{
    {"light on a plate", R"({"integrator": {"type": "photon_distribution"}})"},
    {"photons", R"({"integrator": {"type": "photon_distribution",
                    "density": {"kind": "photon_differential"}}})"},
    {"lens", R"({"receiver": {"distance": $1, "size": [$3, $3], "resolution": [24, 24]},
                 "integrator": {"type": "lens"}})"},
    {"lens by gathering", R"({"integrator": {"type": "lens", "mode": "gather", "image_plane": {"distance": $0.5}}})"},
    {"polariscope", R"({"integrator": {"type": "polariscope"}})"},
    {"paths", R"({"integrator": {"type": "path_tracing", "max_samples": 4, "seeds": {"count": 20}}})"},
    // Of lamps' photons, powers in units of area are checked up to here.
    {"whole", R"({"objects": [{"plate": {"center": [0, 0, $-2.6], "size": [$16, $16]}, "texture": "checkerboard"}],
                  "lights": [{"kind": "directional", "direction": [0.1, 0.15, -1]},
                             {"kind": "area", "center": [0, 0, $3], "direction": [0, 0, -1], "size": [$0.2, $0.2],
                              "strength": 20}],
                  "camera": {"position": [$2.8, $-6.8, $1.6], "target": [0, 0, $-1.4], "resolution": [24, 24]},
                  "integrator": {"type": "scene", "max_samples": 4, "min_samples": 4}})",
     66},
};

/// Writes lengths of a scene in a unit.
std::string in_unit(std::string text, double unit) {
  for (std::size_t at = text.find('$'); at != std::string::npos; at = text.find('$')) {
    std::size_t digits = 0;
    const double length = unit * std::stod(text.substr(at + 1), &digits);
    text.replace(at, 1 + digits, fmt::format("{}", length));
  }
  return text;
}

Image picture_of(const SceneCase& one, double unit) {
  Json json = Json::parse(in_unit(one.text, unit));
  json["field"] = {{"scale", 0.6 / unit}, {"generate", {{"kind", "helix"}}}};
  json["light"]["direction"] = {0.1, 0, -1};
  json["light"]["wavelengths"]["count"] = 4;
  json["light"]["photons"] = 4000;
  if (!json.contains("receiver")) json["receiver"]["resolution"] = {24, 24};
  if (!json.contains("camera")) json["camera"]["resolution"] = {24, 24};
  TensorGrid grid = generate(Helix(), GridSettings{{17, 17, 17}});
  grid.to_world = Eigen::Affine3d(Eigen::Scaling(unit)) * grid.to_world;
  const Scene scene =
      load_scene(read_scene_json(json, "scene.json"), Progress(),
                 prepare_field(source_of(std::move(grid)), {0, false, Eigenvalues::automatic, {}}, "helix"));
  return render(scene, Progress()).linear;
}

TEST(Units, OfLengthDoNotChangeThePicture) {
  for (const SceneCase& one : scenes) {
    const Image expected = picture_of(one, 1);
    // Powers of two near 1e-12, and 1e20 or 1e26: rounding is the same, except where lengths are compared with decimal
    // tolerances.
    for (const int exponent : {-40, one.greatest}) {
      const double unit = std::ldexp(1.0, exponent);
      const Image found = picture_of(one, unit);
      ASSERT_EQ(found.channels, expected.channels);
      ASSERT_EQ(found.pixels.size(), expected.pixels.size());
      std::map<std::string, int> different;  // By channel.
      std::size_t lit = 0;
      for (std::size_t i = 0; i < found.pixels.size(); ++i) {
        const std::string& channel = expected.channels[i % expected.channels.size()];
        const double length = lengths.count(channel) > 0 ? unit : 1, wanted = expected.pixels[i];
        const bool is_same = std::abs(found.pixels[i] / length - wanted) <= 1e-3 * (1 + std::abs(wanted));
        if (!is_same && found.pixels[i] != expected.pixels[i]) ++different[channel];  // Z of nothing is always 1e10.
        if (wanted > 0) ++lit;
      }
      EXPECT_GT(lit, found.pixels.size() / 8) << one.name;
      for (const auto& [channel, count] : different)
        EXPECT_LE(count, 6) << channel << " of " << one.name << " in units of " << unit;
    }
  }
}

}  // namespace
}  // namespace tensorray
