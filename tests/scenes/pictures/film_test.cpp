// What artists bring: scenes in which y is up, pictures on meshes, light that ends smoothly.

#include <fmt/core.h>

#include "base/constants.h"
#include "tests/scenes/pictures/pictures.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

class FilmScene : public Pictures {
 protected:
  /// A quad across z at −2, with u along x and v along y, in a scene in which light is straight. @param more  Of it.
  void write_quad(const std::string& more, const std::string& object = "") {
    write("quad.obj",
          "v -1 -1 -2\nv 1 -1 -2\nv 1 1 -2\nv -1 1 -2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
    const std::string mesh = object.empty() ? "\"file\": \"quad.obj\"" : object;
    write("scene.json", fmt::format(R"({{
      "field": {{"generate": {{"kind": "vortex", "resolution": 9}}, "scale": 1}}, "bending": {{"a": 0, "b": 0}},
      "objects": [{{{}, {}}}], "lights": [{{"kind": "directional", "direction": [0, -0.6427876, -0.7660444]}}],
      "integrator": {{"type": "scene", "bands": 8, "max_samples": 4, "min_samples": 4, "max_depth": 1}},
      "camera": {{"projection": "orthographic", "position": [0.01, 0.02, 5], "target": [0.01, 0.02, 0],
                  "up": [0, 1, 0], "height": 1.5, "resolution": [24, 24]}}}})",
                                    mesh, more));
  }

  void write_picture(const std::string& name, const std::function<Vector3d(int x, int y)>& value) {
    Image image(8, 8, {"R", "G", "B"});
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) Eigen::Map<Eigen::Vector3f>(image.pixel(x, y)) = value(x, y).cast<float>();
    write_image(in_folder(name), image);
  }

  static void expect_near(const Image& a, const Image& b, float tolerance) {
    for (const char* name : {"R", "G", "B"})
      EXPECT_THAT(channel(a, name), testing::Pointwise(testing::FloatNear(tolerance), channel(b, name))) << name;
  }

  /// A wall behind everything.
  const std::string wall_ = R"(objects=[{"plate":{"center":[0,0,-2],"size":[8,8]},"material":{"kind":"diffuse"}}])";

  /// The changes, and a field so weak that light hardly bends.
  static Settings weakened(const Settings& settings) {
    return joined(settings, {"bending.a=0.75", "field.scale=1e-7"});
  }

  /// The same scene with z or y up: a field, meshes and a sky from files; plates, lights, a camera.
  void write_twin(bool y_up) {
    Matrix3d turn = Matrix3d::Identity();
    if (y_up) turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    const Affine3d to_world = Affine3d(turn) * Eigen::Translation3d(-1, -1, -1) * Eigen::Scaling(0.25);
    const auto value = [&](const Vector3i& at) -> Matrix3d {
      const Vector3d p = 0.25 * at.cast<double>() - Vector3d::Ones();
      return turn * std::exp(-2 * p.squaredNorm()) * (p * Vector3d(1, 2, 3).transpose()) * turn.transpose();
    };
    write_tensor_vdb(in_folder("field.vdb"), dense_grid({Vector3i(0, 0, 0), Vector3i(8, 8, 8)}, to_world, value));
    write("body.obj", std::string(y_up ? "v 1 -1 1\nv 1.5 -1 1\nv 1 -1 0.5\nv 1 0.5 1\n"
                                       : "v 1 -1 -1\nv 1.5 -1 -1\nv 1 -0.5 -1\nv 1 -1 0.5\n") +
                          "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    const auto v = [&](double x, double y, double z) {
      return y_up ? fmt::format("[{},{},{}]", x, z, -y) : fmt::format("[{},{},{}]", x, y, z);
    };
    write("scene.json",
          fmt::format(R"({{
      "world": {{"up": "{}"}}, "field": {{"file": "field.vdb", "scale": 2}}, "light": {{"direction": {}}},
      "objects": [{{"plate": {{"center": {}, "normal": {}, "size": [6, 5]}}, "texture": "checkerboard"}},
                  {{"file": "body.obj"}}],
      "lights": [{{"kind": "directional", "direction": {}}}, {{"kind": "area", "center": {}, "size": [2, 1]}},
                 {{"kind": "environment", "file": "sky.png", "rotation": 30}}],
      "camera": {{"position": {}, "target": {}, "resolution": [32, 24]}}, "receiver": {{"resolution": [24, 24]}},
      "integrator": {{"type": "scene", "bands": 8, "max_samples": 4, "min_samples": 4,
                      "seeds": {{"kind": "line", "from": {}, "to": {}, "count": 3}},
                      "caustic": {{"resolution": 32, "rays": 2000, "passes": 1}}}}}})",
                      y_up ? "y" : "z", v(0.1, 0.2, -1), v(0, 0.25, -2), v(0, 0.125, 1), v(0.25, 0.125, -1), v(0, 0, 3),
                      v(3, -6, 2), v(0, 0, -1), v(-0.5, 0, 0), v(0.5, 0, 0.25)));
  }
};

TEST_F(FilmScene, ASceneInWhichYIsUpIsItsTwin) {
  write_picture("sky.png", [](int x, int y) { return Vector3d(0.1 * x, 0.1 * y, 0.5); });
  for (const char* method : {"scene", "photon_distribution", "path_tracing", "lens"}) {
    const Settings type{std::string("integrator.type=") + method};
    write_twin(false);
    const Render z_up = render_all(type, {"z.exr"});
    write_twin(true);
    const Render y_up = render_all(type, {"y.exr"});
    for (const std::string& name : z_up.linear.channels) {
      std::string twin = name;
      if (name == "normal.Y" || name == "displacement.y") twin = name == "normal.Y" ? "normal.Z" : "displacement.z";
      if (name == "normal.Z" || name == "displacement.z") twin = name == "normal.Z" ? "normal.Y" : "displacement.y";
      std::vector<float> expected = channel(z_up.linear, name);
      if (twin != name && (name.back() == 'Y' || name.back() == 'y'))
        for (float& value : expected) value = -value;
      EXPECT_EQ(channel(y_up.linear, twin), expected) << method << name;
    }
    ASSERT_EQ(y_up.paths.size(), z_up.paths.size());
    for (std::size_t i = 0; i < z_up.paths.size(); ++i) {
      const Vector3d at = z_up.paths[i].points.back().position;
      EXPECT_EQ(y_up.paths[i].points.back().position, Vector3d(at.x(), at.z(), -at.y()));
    }
  }
  expect_error(2, "`/world/up` must be one of \"z\", \"y\"", {"world.up=x"});
}

TEST_F(FilmScene, MeshesHavePictures) {
  write_picture("colors.png", [](int x, int y) { return Vector3d(0.1 * x, 0.1 * y, 0.5); });
  write_quad(R"("texture": "colors.png", "material": {"kind": "diffuse"})");
  const Image on_mesh = render({});
  write_quad(R"("texture": "colors.png", "material": {"kind": "diffuse"})",
             R"("plate": {"center": [0, 0, -2], "up": [0, 1, 0], "size": [2, 2]})");
  expect_near(on_mesh, render({}), 1e-4f);
  write_quad(R"("texture": "colors.png", "smooth_angle": 20, "material": {"kind": "diffuse"})");
  expect_near(on_mesh, render({}), 1e-6f);

  write_picture("half.png", [](int, int) { return Vector3d(0, 0.5, 1); });
  write_quad(R"("material": {"kind": "principled", "roughness": 0.5})");
  const Image rough = render({});
  write_quad(R"("roughness_texture": "half.png", "material": {"kind": "principled", "roughness": 0.1})");
  EXPECT_EQ(render({}).pixels, rough.pixels);

  // The light is 40° from the quad's normal, towards +y.
  write_quad(R"("material": {"kind": "diffuse"})");
  const double flat = mean(render({}), "G"), angle = 40 * pi / 180;
  const std::pair<Vector3d, double> tilts[] = {{{0, 0, 1}, 1.0},
                                               {{0, std::sin(angle), std::cos(angle)}, 1 / std::cos(angle)},
                                               {{std::sin(angle), 0, std::cos(angle)}, std::cos(angle)}};
  write_quad(R"("normal_texture": "normals.png", "material": {"kind": "diffuse"})");
  for (const auto& [normal, expected] : tilts) {
    write_picture("normals.png", [n = normal](int, int) { return Vector3d(0.5 * (n + Vector3d::Ones())); });
    EXPECT_NEAR(mean(render({}), "G") / flat, expected, 1e-3) << normal.transpose();
  }

  write("quad.obj", "v -1 -1 -2\nv 1 -1 -2\nv 1 1 -2\nf 1 2 3\n");
  expect_error(1, "quad.obj: has no texture coordinates", {});
  expect_error(2, "`/objects/0/texture`: patterns are for plates", {"objects.0.texture=checkerboard"});
  expect_error(2, "\"diffuse\" has no roughness", {"objects.0.roughness_texture=half.png"});
}

/// Where a field is too weak to be seen, so is the edge of the light that comes through it.
TEST_F(FilmScene, TheLightsEdgeHasNoSeam) {
  write_quad("\"smooth_angle\": 0");
  const Settings wall{wall_, "camera.height=5", "lights.0.direction=[0.3,0.2,-1]", "integrator.max_samples=16",
                      "integrator.caustic.resolution=48"};
  const Image without = render(wall), with = render(weakened(wall));
  EXPECT_GT(mean(with, "caustic.G"), 0.01);
  expect_near(with, without, 2e-3f);
  // Pictures of groups of lights have finite values at that edge, which `render` expects.
  render(weakened({wall_, "camera.height=5",
                   R"(lights=[{"kind":"directional","direction":[0.3,0.2,-1],"angle":0.53,"group":"sun"},
                              {"kind":"constant","strength":0.0005,"group":"sky"}])"}));
}

/// The same for a sun with a disk, on meshes anywhere, and low over a plate.
TEST_F(FilmScene, TheDisksLightHasNoSeam) {
  write_quad("\"smooth_angle\": 0");
  write("quad.obj",
        "v -4 -4 -1.3\nv 0 -4 -1.3\nv 0 4 -1.3\nv -4 4 -1.3\nv 0 -4 -5\nv 4 -4 -5\nv 4 4 -5\nv 0 4 -5\n"
        "f 1 2 3 4\nf 5 6 7 8\n");
  const std::string mesh = R"(objects=[{"file":"quad.obj","material":{"kind":"diffuse"}}])";
  const std::string down = "lights.0.direction=[0,0,-1]", low = "lights.0.direction=[1,0,-0.1]";
  for (const auto& [object, direction] : {std::pair(mesh, down), {wall_, down}, {wall_, low}}) {
    const Settings sun =
        joined(samples(64), {object, direction, "lights.0.angle=20", "camera.height=6", "integrator.noise=0"});
    const Image without = render(sun), with = render(weakened(sun));
    EXPECT_NEAR(mean(with, "G"), mean(without, "G"), 0.02 * mean(without, "G")) << object << direction;
  }
}

TEST_F(FilmScene, TextureCoordinatesOnlyMatterToPictures) {
  write_picture("colors.png", [](int, int) { return Vector3d(0, 0, 1); });
  const std::string quad = "v -1 -1 -2\nv 1 -1 -2\nv 1 1 -2\nv -1 1 -2\n", places = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  for (const std::string& rest :
       std::vector<std::string>{"vt nan nan\nf 1/1 2/1 3/1 4/1\n", "f 1/0 2/0 3/0 4/0\n", "f -4/-4 -3/-3 -2/-2 -1/-1\n",
                                places + "f 1/1 2/2 3/3 4/9\n", places + "f 1/1 2/2 3/3 4/0\n"}) {
    write_quad("\"smooth_angle\": 0");
    write("quad.obj", quad + rest);
    EXPECT_GT(mean(render({}), "G"), 0.01) << rest;
    expect_error(1, "quad.obj: .*texture coordinate.*unwrap it", {"objects.0.texture=colors.png"});
  }
}

TEST_F(FilmScene, WhatIsToldHasTheAxesOfTheFile) {
  write("scene.json", R"({"world": {"up": "y"}, "field": {"generate": {"kind": "vortex", "resolution": 9}},
    "light": {"direction": "auto"}, "receiver": {"resolution": [8, 8]}, "output": {"image": "a.png", "exr_type": "half"},
    "integrator": {"type": "polariscope"}})");
  render_all({});
  EXPECT_THAT(notes_, AllOf(Contains(HasSubstr("light: along [0, -1, 0]")),
                            Contains(HasSubstr("`/output/exr_type` has no effect"))));
  render_all({}, {"maps.nrrd"});
  EXPECT_THAT(bytes_of(in_folder("maps.nrrd")), HasSubstr("(0,0,-0.25)"));
  const Render stretch = render_all({"integrator.type=stretch", "light.direction=[0,-1,0]"});
  EXPECT_EQ(stretch.metadata.at("tensorray:direction"), "0 -1 0");
}

}  // namespace
}  // namespace tensorray
