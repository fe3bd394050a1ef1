// The method "scene": the light of suns, points and lamps, as maps, photons and paths find it.

#include <cmath>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "tests/scenes/pictures/whole_support.h"

namespace tensorray {
namespace {

using namespace test;

/// A plate below a bending field, in the light of nine points (`first`) or of a lamp (`second`): a square of 3 × 3 with
/// the intensity π 100. The lamp is darker by 1% towards the edges.
/// @param integrator  More keys of the integrator.
std::pair<std::string, std::string> points_and_lamp(const std::string& integrator) {
  const std::string common = R"({
    "field": {"generate": {"kind": "point_load", "resolution": 17}, "eigenvalues": "raw", "scale": 1},
    "objects": [{"plate": {"center": [0, 0, -1.5], "size": [1.6, 1.6]}, "material": {"kind": "diffuse"}}],
    "camera": {"projection": "orthographic", "position": [0, 0.001, -1.2], "target": [0, 0, -1.5], "height": 1.4,
               "resolution": [20, 20]},
    "integrator": {"type": "scene", "noise": 0, "max_gain": 0, "bands": 8, "max_depth": 1, )" +
                             integrator + R"(},
    "lights": [)";
  std::string points;
  for (const int x : {-1, 0, 1})
    for (const int y : {-1, 0, 1})
      points += fmt::format(R"({}{{"kind": "point", "position": [{}, {}, 12], "strength": 11.111}})",
                            points.empty() ? "" : ", ", x, y);
  return {common + points + "]}",
          common + R"({"kind": "area", "center": [0, 0, 12], "size": [3, 3], "strength": 34.907}]})"};
}

/// The light of points, traced forwards to the floor, is that of a lamp that the path tracer finds backwards.
TEST_F(WholeScene, TheLightOfPointsThroughTheFieldIsThatOfALamp) {
  const auto [points, lamp] =
      points_and_lamp(R"("max_samples": 128, "min_samples": 128, "caustic": {"resolution": 256, "rays": 20000})");
  write("scene.json", points);
  // Light that is traced beforehand has little noise.
  const Image forwards = render({"integrator.max_samples=16", "integrator.min_samples=16"});
  write("scene.json", lamp);
  const std::string none = "integrator.photons.per_pass=0";
  const Image backwards = render({none}), other_law = render({none, "integrator.conserve=radiance"});
  EXPECT_GT(mean(forwards, "G"), 0.2);
  EXPECT_NEAR(mean(forwards, "G"), mean(backwards, "G"), 0.03 * mean(backwards, "G"));
  EXPECT_GT(std::abs(mean(other_law, "G") / mean(backwards, "G") - 1), 0.1);
}

/// A plate that light meets before the middle of the volume, and one along the light, which both sides of light meet.
TEST_F(WholeScene, AWeakFieldLightsPlatesWithinTheVolume) {
  const Settings sets{
      "objects=[{\"plate\":{\"center\":[0,0,-0.4],\"size\":[1.2,1.2]},\"material\":{\"kind\":\"diffuse\"}},"
      "{\"plate\":{\"center\":[0,0.4,-1],\"normal\":[0,1,0],\"size\":[1.6,1]},\"material\":{\"kind\":\"diffuse\"}}]",
      "lights=[{\"kind\":\"directional\",\"direction\":[0.3,0.2,-1],\"caustic\":\"photons\"},"
      "{\"kind\":\"point\",\"position\":[0.4,-0.8,2],\"strength\":5}]",
      "integrator.max_samples=16",
      "integrator.min_samples=16",
      "integrator.max_depth=1",
      "camera.position=[1,-3,2]",
      "camera.target=[0,0,-0.6]"};
  const Image with = expect_weak_as_none(sets);
  EXPECT_GT(mean(with, "caustic.G"), 0.9 * mean(with, "G"));
  EXPECT_EQ(render(weakened(sets), {}, 1).pixels, with.pixels);
}

/// A point within the volume, and lamps there, of which the large one has no photons, light a plate below and one
/// within, beside a sky.
TEST_F(WholeScene, AWeakFieldIsLitFromWithinAsIfItWereNotThere) {
  for (const char* light : {R"({"kind":"point","position":[0.1,0.2,-0.5],"strength":1})",
                            R"({"kind":"area","center":[0.1,0.2,-0.5],"size":[0.2,0.2],"strength":20})",
                            R"({"kind":"area","center":[0.1,0.2,-0.5],"size":[0.6,0.6],"strength":3})"}) {
    const Settings sets{
        "objects=[{\"plate\":{\"center\":[0,0,-2.6],\"size\":[4,4]},\"material\":{\"kind\":\"diffuse\"}},"
        "{\"plate\":{\"center\":[0.4,0,-1.2],\"size\":[0.8,0.8]},\"material\":{\"kind\":\"diffuse\"}}]",
        std::string("lights=[{\"kind\":\"constant\",\"strength\":0.2},") + light + "]",
        "integrator.max_samples=16",
        "integrator.min_samples=16",
        "camera.position=[1,-4,3]",
        "camera.target=[0,0,-1.6]"};
    SCOPED_TRACE(light);
    const Image with = expect_weak_as_none(sets);
    EXPECT_GT(mean(with, "G"), 0.01);
  }
}

/// A plate along the light in the lower half of the volume, and one below the volume. Light that hardly bends meets
/// their outer sides; light that bends more meets the inner ones. A flow map has one side.
TEST_F(WholeScene, PlatesAlongTheLightAreLitOnBothSides) {
  for (const double z : {-1.5, -2.4}) {
    std::vector<double> automatic, map;
    for (const double side : {-1.0, 1.0}) {
      Settings sets{
          fmt::format(R"(objects=[{{"plate":{{"center":[0,0.35,{}],"normal":[0,1,0],"size":[1.4,0.6]}}}}])", z),
          R"(lights=[{"kind":"directional","direction":[0,-0.1,-1]}])",
          "integrator.max_samples=8",
          "integrator.min_samples=8",
          "integrator.max_depth=1",
          fmt::format("camera.position=[0,{},{}]", 4 * side, z),
          fmt::format("camera.target=[0,0.35,{}]", z)};
      automatic.push_back(mean(render(sets), "R"));
      sets.push_back("lights.0.caustic=map");
      map.push_back(mean(render(sets), "R"));
    }
    for (const double each : automatic) EXPECT_GT(each, 4e-4) << z;
    EXPECT_LT(std::min(map[0] / automatic[0], map[1] / automatic[1]), 0.1) << z;
  }
}

}  // namespace
}  // namespace tensorray
