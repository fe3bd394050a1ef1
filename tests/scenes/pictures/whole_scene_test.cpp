// The method "scene": surfaces in light that a field bends, seen through the field.

#include <fmt/core.h>

#include "tests/scenes/pictures/pictures.h"
#include "tests/tracing/support.h"

namespace tensorray {
namespace {

class WholeScene : public Pictures {
 protected:
  /// A small point load with all default objects and lights.
  WholeScene() {
    write("scene.json", R"({
      "field": {"generate": {"kind": "point_load", "resolution": 17}, "eigenvalues": "absolute"},
      "integrator": {"type": "scene", "max_samples": 4, "min_samples": 4, "noise": 0,
                     "caustic": {"resolution": 64, "rays": 4000, "passes": 1}},
      "camera": {"resolution": [40, 32]}})");
  }

  /// The changes, and a field so weak that light hardly bends.
  static Settings weakened(const Settings& sets) { return joined(sets, {"field.scale=1e-7"}); }

  /// A weak field gives the mean colours of a scene in which nothing bends, though light is found in other ways.
  /// @return the picture with the weak field.
  Image expect_weak_as_none(const Settings& sets, double tolerance = 0.02) {
    const Image with = render(weakened(sets)), without = render(joined(sets, {"bending.a=0", "bending.b=0"}));
    for (const char* channel : {"R", "G", "B"})
      EXPECT_NEAR(mean(with, channel) / mean(without, channel), 1, tolerance) << channel;
    return with;
  }
};

TEST_F(WholeScene, HasTheSameBytesOnAnyNumberOfThreads) {
  const Image one = render({}, {}, 1);
  for (const int threads : {2, 7}) EXPECT_EQ(one.pixels, render({}, {}, threads).pixels) << threads;
}

TEST_F(WholeScene, BendsWhatTheCameraSeesAndTheSunsLight) {
  const Image image = render({});
  EXPECT_GT(mean(image, "deflection"), 0.01);
  EXPECT_GT(mean(image, "caustic.G"), 0.01);
  EXPECT_NEAR(mean(image, "caustic.G") + mean(image, "straight.G"), mean(image, "G"), 1e-4);
}

/// A field that bends nothing, of either kind, gives the picture of the straight path tracer, bit for bit.
TEST_F(WholeScene, AnIsotropicFieldIsNotThere) {
  std::vector<Image> images;
  for (const double value : {0.0, 3.7}) {
    const std::string tensor = fmt::format("[[{0},0,0],[0,{0},0],[0,0,{0}]]", value);
    images.push_back(render({R"(field.generate={"kind":"constant","resolution":9,"tensor":)" + tensor + "}",
                             "field.scale=1", "field.eigenvalues=raw"}));
  }
  EXPECT_EQ(images[0].pixels, images[1].pixels);
  EXPECT_GT(mean(images[0], "R"), 0.05);
}

/// Light that hardly bends must give that picture, too, though it is found in other ways: the sun by its flow map, the
/// rest band by band.
TEST_F(WholeScene, AWeakFieldGivesThePictureWithoutIt) { expect_weak_as_none(samples(64), 0.01); }

TEST_F(WholeScene, PathsAreObjects) {
  const std::string floor = R"({"plate":{"center":[0,0,-2.6],"size":[8,8]}})";
  const Image with = render({"objects=[" + floor + R"(,{"paths":{"count":9}}])"});
  const Image without = render({"objects=[" + floor + "]"});
  EXPECT_GT(mean(with, "force"), 0);
  EXPECT_EQ(mean(without, "force"), 0);
  EXPECT_NE(with.pixels, without.pixels);
  expect_error(2, "/objects/0/paths/count", {R"(objects=[{"paths":{"count":0}}])"});
  expect_error(2, "/objects/0", {R"(objects=[{"paths":{},"file":"a.ply"}])"});
  expect_error(2, "`/integrator/style`", {R"(objects=[{"paths":{}}])", "integrator.style=lines"});
}

TEST_F(WholeScene, AnEvenSkyThroughTheFieldIsEvenIfRadianceIsConserved) {
  const Settings sky{R"(lights=[{"kind":"constant"}])", "integrator.max_depth=1",
                     R"(objects=[{"plate":{"center":[0,0,-50],"size":[0.01,0.01]}}])", "camera.position=[0,-6,0]",
                     "camera.target=[0,0,0]"};
  const auto is_even = [](float tolerance) { return testing::Each(testing::FloatNear(1, tolerance)); };
  // At the volume's edge, straight and bent samples of a pixel share the bands unevenly: noise, not a bias.
  EXPECT_THAT(channel(render(joined(sky, {"integrator.conserve=radiance"})), "G"), is_even(0.02f));
  EXPECT_THAT(channel(render(sky), "G"), Not(is_even(0.1f)));
}

TEST_F(WholeScene, GroupsOfLightsAddUpToThePicture) {
  const Settings lights{R"(lights=[
      {"kind": "constant", "color": [0.2, 0.3, 0.6], "group": "around"},
      {"kind": "directional", "direction": [0.2, 0, -1], "angle": 2, "group": "sun"},
      {"kind": "point", "position": [1, 1, 3], "strength": 5, "group": "lamps"},
      {"kind": "area", "center": [-1, 0, 3], "group": "lamps"}])"};
  const auto lit = [&](const Settings& changes) { return render(joined(joined(samples(8), lights), changes)); };
  const Image photons = lit({"lights.1.caustic=photons", "lights.2.caustic=photons"}), all = lit({});
  for (const std::string color : {"sun.G", "lamps.G"})
    EXPECT_NEAR(mean(photons, color), mean(all, color), 0.03 * mean(all, color)) << color;
  for (const char* color : {"R", "G", "B"}) {
    double sum = 0;
    for (const std::string group : {"around.", "sun.", "lamps."}) {
      EXPECT_GT(mean(all, group + color), 0.01) << group;
      sum += mean(all, group + color);
    }
    EXPECT_NEAR(sum, mean(all, color), 1e-4 * sum) << color;
  }
  EXPECT_GE(mean(all, "folds"), 0.05);
  // A group has the light that the picture has if all others are dark.
  const Image sun = lit({"lights.0.strength=0", "lights.2.strength=0", "lights.3.strength=0"});
  EXPECT_NEAR(mean(all, "sun.G"), mean(sun, "G"), 0.1 * mean(sun, "G"));
}

TEST_F(WholeScene, RefusesWhatDoesNotFit) {
  expect_error(2, "/integrator/bands_per_sample", {"integrator.bands_per_sample=7"});
  expect_error(2, "/integrator/conserve", {"integrator.conserve=light"});
  expect_error(1, "none.ply", {R"(objects=[{"file":"none.ply"}])"});
  expect_error(2, "/objects/0", {"objects=[{}]"});
  expect_error(2, "/objects/0/plate", {R"(objects=[{"plate":{}}])"});
  expect_error(2, "/objects/0/texture", {R"(objects=[{"file":"none.ply","texture":"checkerboard"}])"});
  expect_error(1, "none.png", {R"(objects=[{"plate":{"center":[0,0,0]},"texture":"none.png"}])"});
  expect_error(2, "/objects/0/plate/colour", {R"(objects=[{"plate":{"center":[0,0,0],"colour":1}}])"});
  expect_error(2, "/lights/0` is a point and needs its `position`", {R"(lights=[{"kind":"point"}])"});
  expect_error(2,
               "/lights/0` has no map of its light: the light is within the volume, or too near; move it away, or use",
               {R"(lights=[{"kind":"point","position":[0,0,-0.9],"caustic":"map"}])"});
  expect_error(2, "/lights/0/caustic", {R"(lights=[{"kind":"point","position":[0,0,3],"caustic":"none"}])"});
  expect_error(2, "/lights/0/caustic", {R"(lights=[{"kind":"area","center":[0,0,3],"caustic":"map"}])"});
  expect_error(2, "/integrator/indirect_clamp", {"integrator.indirect_clamp=-1"});
  expect_error(2, "/integrator/max_seconds", {"integrator.max_seconds=0"});
  expect_error(2, "/integrator/photons/max_radius", {"integrator.photons.max_radius=0"});
  expect_error(2, "/lights/0/group", {R"(lights=[{"kind":"constant","group":"albedo"}])"});
}

TEST_F(WholeScene, EmptyListsMeanNone) {
  // Without objects there is only the sky; without lights, nothing shines.
  const Image sky = render({"objects=[]", R"(lights=[{"kind":"constant","strength":0.5}])", "field.scale=1e-9"});
  EXPECT_NEAR(mean(sky, "G"), 0.5, 1e-3);
  EXPECT_GT(mean(render({"objects=[]"}), "B"), 0);  // The default lights.
  EXPECT_EQ(mean(render({"lights=[]"}), "G"), 0);
  EXPECT_EQ(mean(render({"lights=[]", "objects=[]"}), "G"), 0);
  EXPECT_GT(mean(render({}), "G"), 0);
  const Settings paths{"integrator.type=path_tracing", "integrator.background_color=[0,0,0]"};
  EXPECT_EQ(mean(render({paths[0], paths[1], "lights=[]"}), "G"), 0);
  EXPECT_GT(mean(render(paths), "G"), 0);
}

TEST_F(WholeScene, RefusesMoreLightThanFitsIntoMemory) {
  std::string lights;
  for (int i = 0; i < 10000; ++i) lights += R"({"kind":"point","position":[0,0,3]},)";
  lights.back() = ']';
  expect_error(2, "`/lights`", {"lights=[" + lights, "integrator.caustic.resolution=1024"});
  expect_error(
      2, "/integrator/photons/per_pass",
      {R"(lights=[{"kind":"directional","caustic":"photons"},)" + lights, "integrator.photons.per_pass=4000000000"});
}

/// A sun in the plane of the floor, a floor through the volume, a camera inside the volume, one inside a body, one that
/// looks away, one that looks into the point under the load, where the stress is singular, and a lamp inside a body.
TEST_F(WholeScene, OddPlacesGiveAPicture) {
  write_mesh(in_folder("body.ply"), box_between({-0.5, -0.5, -2.7}, {0.5, 0.5, -2.3}), {});
  for (const Settings& sets : std::vector<Settings>{
           {R"(lights=[{"kind":"directional","direction":[1,0,0]}])"},
           {R"(objects=[{"plate":{"center":[0,0,0],"size":[8,8]},"texture":"checkerboard"}])"},
           {"camera.position=[0.1,0.2,-0.4]", "camera.target=[0,0,-3]"},
           {R"(obstacles=[{"file":"body.ply"}])", "camera.position=[0,0,-2.5]", "camera.target=[0,0,-3]"},
           {"camera.position=[0,-6,0]", "camera.target=[0,-9,0]"},
           {"camera.position=[0,-3,0.4]", "camera.target=[0,0,0]", "camera.angle=3"},
           {R"(obstacles=[{"file":"body.ply"}])",
            R"(lights=[{"kind":"constant"},{"kind":"point","position":[0,0,-2.5]}])"}}) {
    EXPECT_GT(mean(render(sets), "A"), 0.99) << sets[0];  // It expects finite values.
  }
}

/// A plate below a bending field, in the light of nine points or of a lamp: a square of 3 × 3 with the intensity π 100.
/// The lamp is darker by 1% towards the edges.
TEST_F(WholeScene, TheLightOfPointsThroughTheFieldIsThatOfALamp) {
  write("scene.json", R"({
    "field": {"generate": {"kind": "point_load", "resolution": 17}, "eigenvalues": "raw", "scale": 1},
    "objects": [{"plate": {"center": [0, 0, -1.5], "size": [1.6, 1.6]}, "material": {"kind": "diffuse"}}],
    "camera": {"projection": "orthographic", "position": [0, 0.001, -1.2], "target": [0, 0, -1.5], "height": 1.4,
               "resolution": [20, 20]},
    "integrator": {"type": "scene", "noise": 0, "max_gain": 0, "bands": 8, "max_depth": 1,
                   "max_samples": 128, "min_samples": 128, "caustic": {"resolution": 256, "rays": 20000}}})");
  Settings points = samples(16);  // Light that is traced beforehand has little noise.
  for (int i = 0; i < 9; ++i)
    points.push_back(fmt::format(R"(lights.{}={{"kind": "point", "position": [{}, {}, 12], "strength": 11.111}})", i,
                                 i / 3 - 1, i % 3 - 1));
  const Settings lamp{R"(lights=[{"kind": "area", "center": [0, 0, 12], "size": [3, 3], "strength": 34.907}])",
                      "integrator.photons.per_pass=0"};
  const Image forwards = render(points);
  const Image backwards = render(lamp), other_law = render(joined(lamp, {"integrator.conserve=radiance"}));
  EXPECT_GT(mean(forwards, "G"), 0.2);
  EXPECT_NEAR(mean(forwards, "G"), mean(backwards, "G"), 0.03 * mean(backwards, "G"));
  EXPECT_GT(std::abs(mean(other_law, "G") / mean(backwards, "G") - 1), 0.1);
}

/// A plate that light meets before the middle of the volume, and one along the light, which both sides of light meet.
TEST_F(WholeScene, AWeakFieldLightsPlatesWithinTheVolume) {
  const std::string plates = R"(objects=[
      {"plate": {"center": [0, 0, -0.4], "size": [1.2, 1.2]}, "material": {"kind": "diffuse"}},
      {"plate": {"center": [0, 0.4, -1], "normal": [0, 1, 0], "size": [1.6, 1]}, "material": {"kind": "diffuse"}}])";
  const std::string lights = R"(lights=[{"kind": "directional", "direction": [0.3, 0.2, -1], "caustic": "photons"},
                                        {"kind": "point", "position": [0.4, -0.8, 2], "strength": 5}])";
  const Settings sets = joined(
      samples(16), {plates, lights, "camera.position=[1,-3,2]", "camera.target=[0,0,-0.6]", "integrator.max_depth=1"});
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
    SCOPED_TRACE(light);
    const std::string plates =
        R"(objects=[{"plate": {"center": [0, 0, -2.6], "size": [4, 4]}, "material": {"kind": "diffuse"}},
                    {"plate": {"center": [0.4, 0, -1.2], "size": [0.8, 0.8]}, "material": {"kind": "diffuse"}}])";
    const std::string lights = std::string(R"(lights=[{"kind": "constant", "strength": 0.2}, )") + light + "]";
    const Image with = expect_weak_as_none(
        joined(samples(16), {plates, lights, "camera.position=[1,-4,3]", "camera.target=[0,0,-1.6]"}));
    EXPECT_GT(mean(with, "G"), 0.01);
  }
}

/// A plate along the light in the lower half of the volume, and one below the volume. Light that hardly bends meets
/// their outer sides; light that bends more meets the inner ones. A flow map has one side.
TEST_F(WholeScene, PlatesAlongTheLightAreLitOnBothSides) {
  for (const double z : {-1.5, -2.4}) {
    std::vector<double> automatic, map;
    for (const double side : {-1.0, 1.0}) {
      const std::string place = fmt::format("[0,0.35,{}]", z);
      const std::string plate = R"(objects=[{"plate":{"center":)" + place + R"(,"normal":[0,1,0],"size":[1.4,0.6]}}])";
      const Settings sets = joined(samples(8), {plate, R"(lights=[{"kind":"directional","direction":[0,-0.1,-1]}])",
                                                fmt::format("camera.position=[0,{},{}]", 4 * side, z),
                                                "camera.target=" + place, "integrator.max_depth=1", "field.scale=4.7"});
      automatic.push_back(mean(render(sets), "R"));
      map.push_back(mean(render(joined(sets, {"lights.0.caustic=map"})), "R"));
    }
    for (const double each : automatic) EXPECT_GT(each, 4e-4) << z;
    EXPECT_LT(std::min(map[0] / automatic[0], map[1] / automatic[1]), 0.1) << z;
  }
}

}  // namespace
}  // namespace tensorray
