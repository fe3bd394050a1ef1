// Path tracing: pictures and files of the bent rays.

#include <set>

#include "integrators/path_tracing/path_colors.h"
#include "scenes/outputs/picture_outputs.h"
#include "tests/scenes/pictures/pictures.h"

namespace tensorray {
namespace {

/// A scene that renders quickly. The volume reaches from -1 to 1, and from -2 to 0 along z.
constexpr const char* small_paths =
    R"({"field": {"generate": {"kind": "point_load", "resolution": 9}, "scale": 6},
             "light": {"photons": 500, "wavelengths": {"count": 4}},
             "receiver": {"resolution": [16, 16]},
             "integrator": {"type": "path_tracing", "seeds": {"count": 16}, "max_samples": 4, "noise": 0,
                            "filter": "box"},
             "camera": {"resolution": [24, 16]}})";

/// The covered area of the picture, in pixels.
double covered(const Image& image) { return sum(channel(image, "A")); }

constexpr const char* seen_from_the_side =
    R"(camera={"position": [0, -6, 2], "target": [0, 0, -1], "resolution": [24, 16]})";
constexpr const char* transparent = "integrator.background=transparent";
constexpr const char* without_box = "integrator.context.box=false";

class Paths : public Pictures {
 protected:
  Paths() { write("scene.json", small_paths); }
};

TEST_F(Paths, TheSameBytesOnAnyNumberOfThreads) {
  const Settings names{"out.png", "linear.exr", "out.spectral.exr", "out.vtp", "out.ply"};
  std::vector<std::string> one;
  for (const int threads : {1, 2, 7}) {
    render_all({"integrator.context.plate=true", "integrator.context.slice={}", "camera.lens_radius=0.1",
                "integrator.min_samples=2", "integrator.noise=0.1", "integrator.seeds.kind=poisson_disk"},
               names, threads);
    std::vector<std::string> contents;
    for (const std::string& name : names) contents.push_back(bytes_of(in_folder(name)));
    if (one.empty()) one = contents;
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_TRUE(contents[i] == one[i]) << names[i];
  }
}

/// Each value of a key is another picture. A curvature is s times the transverse force: within its own range, the same.
TEST_F(Paths, StylesColoursAndMaterialsAreDifferent) {
  const Settings plain{transparent, without_box}, thick{"integrator.radius.typical=0.1", without_box};
  const Settings coloured{"integrator.radius.typical=0.05", "integrator.shading=headlight", without_box};
  const Settings styles{"tube", "wire", "ellipses", "lines"};
  const Settings colours{"force",      "transverse_force", "curvature", "length",
                         "wavelength", "direction",        "invariant", "none"};
  const Settings materials{R"({"kind": "diffuse"})", R"({"kind": "principled"})",
                           R"({"kind": "principled", "clearcoat": 1})", R"({"kind": "metal", "metal": "copper"})",
                           R"({"kind": "glass"})"};
  struct Case {
    std::string key, channel;
    Settings values, more;
  };
  for (const Case& each :
       {Case{"integrator.style", "R", styles, plain}, Case{"integrator.color.by", "albedo.R", colours, coloured},
        Case{"integrator.material", "R", materials, thick}}) {
    std::set<std::vector<float>> pictures;
    for (const std::string& value : each.values) {
      const Image image = render(joined(each.more, {each.key + "=" + value}), {"out.vtp"});
      EXPECT_GT(covered(image), 0) << value;
      EXPECT_GE(greatest(channel(image, "path")), 3) << value;
      EXPECT_GT(greatest(channel(image, "force")), 0) << value;
      const std::string lines = value == "wavelength" ? "NumberOfLines=\"64\"" : "NumberOfLines=\"16\"";
      EXPECT_THAT(bytes_of(in_folder("out.vtp")), HasSubstr(lines)) << "a path a wavelength";
      pictures.insert(channel(image, each.channel));
      if (value == "none") {
        EXPECT_NEAR(greatest(channel(image, "albedo.R")), 0.7, 0.01);
      }
    }
    EXPECT_EQ(pictures.size(), each.values.size() - (each.values == colours ? 1 : 0)) << each.key;
  }
}

TEST_F(Paths, SeedsOfEveryKind) {
  write("seeds.txt", "# Two points\n0 0 0\n0.3, 0.2, -0.5\n");
  for (const std::string kind : {"grid", "poisson_disk", "line", "sphere", "threshold", "file"}) {
    Settings changes{"integrator.seeds.kind=" + kind, transparent, without_box};
    if (kind == "file") changes.emplace_back("integrator.seeds.file=seeds.txt");
    if (kind == "threshold") changes.emplace_back("integrator.seeds.above=0.5");
    const Image image = render(changes, {"out.tck"});
    EXPECT_GT(covered(image), 0) << kind;
    EXPECT_THAT(bytes_of(in_folder("out.tck")), HasSubstr(kind == "file" ? "count: 2\n" : "count: 16\n")) << kind;
  }
}

TEST_F(Paths, FilesOfPathsNeedNoPictureAndGiveTheSameOne) {
  const auto expect_same = [&](const std::string& a, const std::string& b) {
    for (const std::string ending : {".ply", ".vtp"})
      EXPECT_TRUE(bytes_of(in_folder(a + ending)) == bytes_of(in_folder(b + ending))) << a << b << ending;
  };
  render({}, {"out.vtp", "out.ply", "out.png"});
  render_all({}, {"alone.ply"});
  render_all({}, {"alone.vtp"});
  EXPECT_EQ(statistics_["seconds"]["draw"], 0);
  expect_same("alone", "out");
  // A given radius does not depend on the seeds, which a file of paths does not contain.
  const std::string radius = "integrator.radius.typical=0.04";
  const Image traced = render({radius}, {"given.vtp", "given.ply"});
  EXPECT_TRUE(render({radius, "integrator.paths=given.vtp"}, {"again.vtp", "again.ply"}).pixels == traced.pixels);
  expect_same("again", "given");
}

TEST_F(Paths, WhatAUserCanGetWrong) {
  expect_error(2, "/integrator/seeds.*`file`", {"integrator.seeds.kind=file"});
  expect_error(1, "none.txt", {"integrator.seeds.kind=file", "integrator.seeds.file=none.txt"});
  expect_error(2, "/integrator/seeds.*`above` or `below`", {"integrator.seeds.kind=threshold"});
  expect_error(2, "scene.json.*/integrator/seeds.*from .* to ",
               {"integrator.seeds.kind=threshold", "integrator.seeds.above=1e9"});
  expect_error(1, "/integrator/seeds.*/light/direction",
               {"integrator.seeds.kind=sphere", "integrator.seeds.center=[9,9,9]"});
  write("junk.vtp", "This is no file of paths.");
  for (const std::string file : {"junk.vtp", "none.vtp"}) expect_error(1, file, {"integrator.paths=" + file});
  expect_error(2, "/integrator/color/range.*rise", {"integrator.color.range=[2,1]"});
  expect_error(2, "/integrator/color/range.*above 0",
               {"integrator.color.range=[0,1]", "integrator.color.logarithmic=true"});
  expect_error(2, "/integrator/context/slice/range.*rise", {R"(integrator.context.slice={"range": [1, 1]})"});
  expect_error(2, "/integrator/context/slice", {R"(integrator.context.slice={"center": [0, 5, 0]})"});
  expect_error(2, "/integrator/context/isosurfaces.*nowhere", {R"(integrator.context.isosurfaces=[{"value": 1e9}])"});
  expect_error(2, "/lights/0.*file", {R"(lights=[{"kind": "environment"}])"});
  expect_error(1, "none.exr", {R"(lights=[{"kind": "environment", "file": "none.exr"}])"});
  expect_error(2, "/lights/0.*center", {R"(lights=[{"kind": "area"}])"});
  expect_error(2, "/integrator/material/metal.*gold.*cheese",
               {"integrator.material.kind=metal", "integrator.material.metal=cheese"});
  expect_error(2, "/output/photons.*no photons", {}, {"out.vdb"});
}

TEST_F(Paths, ContextIsShown) {
  const auto with = [&](const std::string& setting) { return render({transparent, seen_from_the_side, setting}); };
  const double plain = covered(render({transparent, seen_from_the_side}));
  EXPECT_LT(covered(with(without_box)), plain - 1);
  std::vector<Image> pictures;
  for (const char* setting : {"integrator.context.plate=true", "integrator.context.slice={}",
                              R"(integrator.context.isosurfaces=[{"invariant": "norm", "value": 1}])"}) {
    pictures.push_back(with(setting));
    const Image& image = pictures.back();
    EXPECT_GT(covered(image), plain + 4) << setting;
    const std::vector<float> alpha = channel(image, "A"), path = channel(image, "path"),
                             force = channel(image, "force");
    for (std::size_t i = 0; i < alpha.size(); ++i)
      if (path[i] == -1) {
        EXPECT_EQ(force[i], 0) << setting;
      }
  }
  EXPECT_NE(with(R"(integrator.context.slice={"map": "magma"})").pixels, pictures[1].pixels);
  const Image& caustic = pictures[0];
  const std::vector<float> light = channel(caustic, "albedo.G"), alpha = channel(caustic, "A"),
                           path = channel(caustic, "path");
  std::set<float> shades;
  for (std::size_t i = 0; i < light.size(); ++i)
    if (alpha[i] == 1 && path[i] == -1) shades.insert(light[i]);
  EXPECT_GT(shades.size(), 10u);
}

TEST_F(Paths, Backgrounds) {
  const auto corner = [&](const Settings& settings) -> Vector4f {
    const Image image = render(settings);
    return {channel(image, "R")[0], channel(image, "G")[0], channel(image, "B")[0], channel(image, "A")[0]};
  };
  EXPECT_LT((corner({}) - Vector4f(1, 1, 1, 1)).norm(), 1e-4f);
  EXPECT_LT((corner({"integrator.background_color=[0.2,0.2,0.2]"}) - Vector4f(0.2f, 0.2f, 0.2f, 1)).norm(), 1e-4f);
  EXPECT_EQ(corner({transparent}), Vector4f(0, 0, 0, 0));
  const Vector4f sky = corner({"integrator.background=lights", R"(lights=[{"kind": "constant", "strength": 0.3}])"});
  EXPECT_LT((sky - Vector4f(0.3f, 0.3f, 0.3f, 1)).norm(), 2e-3f);
}

TEST_F(Paths, PreviewsNeedNoLights) {
  const std::string dark = R"(lights=[{"kind": "constant", "strength": 0}])";
  EXPECT_EQ(sum(channel(render({transparent, dark}), "R")), 0);
  for (const std::string shading : {"ambient_occlusion", "headlight"}) {
    const Image image = render({transparent, "integrator.shading=" + shading, dark});
    EXPECT_GT(sum(channel(image, "R")), 1) << shading;
    const std::vector<float> red = channel(image, "R"), albedo = channel(image, "albedo.R");
    for (std::size_t i = 0; i < red.size(); ++i) EXPECT_LE(red[i], albedo[i] + 0.02f) << shading;
  }
}

/// A path down from the origin that turns aside by one unit after a way of 1, and goes on down.
Path path_of(double wavelength, double aside) {
  Path path;
  path.wavelength = wavelength;
  for (const Vector3d& position :
       {Vector3d(0, 0, 0), Vector3d(0, 0, -1), Vector3d(aside, 0, -2), Vector3d(aside, 0, -3)}) {
    PathPoint point;
    point.position = position;
    path.points.push_back(point);
  }
  return path;
}

std::vector<std::vector<Vector3d>> colors_of(const std::vector<Path>& paths, double radius) {
  PathColorDescription description;
  description.by = PathColor::wavelength;
  return path_colors(description, paths, radius, {}).of_points;
}

/// Where paths of one seed lie in one another they have one colour, so that it does not matter which is seen.
TEST(PathColors, WavelengthsMixUntilTheyPart) {
  const std::vector<Path> paths{path_of(450, 0), path_of(550, 1), path_of(650, 2)};
  const auto colors = colors_of(paths, 0.4);
  const Vector3d mean = (wavelength_color(450) + wavelength_color(550) + wavelength_color(650)) / 3;
  for (std::size_t path = 0; path < paths.size(); ++path)
    for (const std::size_t point : {0, 1, 2, 3})
      EXPECT_TRUE(colors[path][point].isApprox(point < 2 ? mean : wavelength_color(paths[path].wavelength)))
          << path << point;
}

/// Wavelengths of one seed rise, or fall: of red, green and blue, red comes first. Seeds do not mix. At half the radius
/// from another path, its colour counts half.
TEST(PathColors, MixBySeedAndDistance) {
  const auto mean = [](double a, double b) -> Vector3d { return (wavelength_color(a) + wavelength_color(b)) / 2; };
  for (const auto& path : colors_of({path_of(650, 0), path_of(450, 1), path_of(650, 0), path_of(450, 1)}, 0.5))
    EXPECT_TRUE(path[0].isApprox(mean(450, 650)));
  const auto seeds = colors_of({path_of(450, 0), path_of(650, 0), path_of(550, 0), path_of(700, 0)}, 1);
  EXPECT_TRUE(seeds[0][0].isApprox(mean(450, 650)));
  EXPECT_TRUE(seeds[3][0].isApprox(mean(550, 700)));
  const auto apart = colors_of({path_of(450, 0), path_of(650, 1)}, 2);
  EXPECT_TRUE(apart[0][3].isApprox((wavelength_color(450) + 0.5 * wavelength_color(650)) / 1.5));
}

}  // namespace
}  // namespace tensorray
