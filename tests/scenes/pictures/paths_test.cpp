// Path tracing: pictures and files of the bent rays.

#include <set>

#include <gmock/gmock.h>

#include "tests/scenes/pictures/paths_support.h"

namespace tensorray {
namespace {

using namespace test;

TEST_F(Paths, TheSameBytesOnAnyNumberOfThreads) {
  const Settings names{"out.png", "linear.exr", "out.spectral.exr", "out.vtp", "out.ply"};
  std::vector<std::string> one;
  for (const int threads : {1, 2, 7}) {
    render_all({"integrator.context.plate=true", "integrator.context.slice={}", "camera.lens_radius=0.1",
                "integrator.min_samples=2", "integrator.noise=0.1", "integrator.seeds.kind=poisson_disk"},
               names, threads);
    std::vector<std::string> contents;
    for (const std::string& name : names) contents.push_back(read_file(in_folder(name)));
    if (one.empty()) one = contents;
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_TRUE(contents[i] == one[i]) << names[i];
  }
}

TEST_F(Paths, EveryStyleIsAnotherPicture) {
  std::set<std::vector<float>> pictures;
  for (const std::string style : {"tube", "wire", "ellipses", "lines"}) {
    const Image image = render({"integrator.style=" + style, transparent, without_box});
    EXPECT_GT(covered(image), 0) << style;
    EXPECT_GE(greatest(channel(image, "path")), 3) << style;
    EXPECT_GT(greatest(channel(image, "force")), 0) << style;
    pictures.insert(channel(image, "R"));
  }
  EXPECT_EQ(pictures.size(), 4u);
}

TEST_F(Paths, SeedsOfEveryKind) {
  write("seeds.txt", "# Two points\n0 0 0\n0.3, 0.2, -0.5\n");
  for (const std::string kind : {"grid", "poisson_disk", "line", "sphere", "threshold", "file"}) {
    std::vector<std::string> changes{"integrator.seeds.kind=" + kind, transparent, without_box};
    if (kind == "file") changes.emplace_back("integrator.seeds.file=seeds.txt");
    if (kind == "threshold") changes.emplace_back("integrator.seeds.above=0.5");
    const Image image = render(changes, {"out.tck"});
    EXPECT_GT(covered(image), 0) << kind;
    const std::string tracks = read_file(in_folder("out.tck"));
    EXPECT_NE(tracks.find(kind == "file" ? "count: 2\n" : "count: 16\n"), std::string::npos) << kind;
  }
}

TEST_F(Paths, ColoursOfEveryKind) {
  std::set<std::vector<float>> pictures;
  for (const std::string by :
       {"force", "transverse_force", "curvature", "length", "wavelength", "direction", "invariant", "none"}) {
    const Image image = render(
        {"integrator.color.by=" + by, "integrator.radius.typical=0.05", "integrator.shading=headlight", without_box},
        {"out.vtp"});
    const std::string lines = by == "wavelength" ? "NumberOfLines=\"64\"" : "NumberOfLines=\"16\"";
    EXPECT_NE(read_file(in_folder("out.vtp")).find(lines), std::string::npos) << "a path a wavelength";
    pictures.insert(channel(image, "albedo.R"));
    if (by == "none") {
      EXPECT_NEAR(greatest(channel(image, "albedo.R")), 0.7, 0.01);
    }
  }
  EXPECT_EQ(pictures.size(), 7u) << "curvature is s times the transverse force: within its own range, the same";
}

TEST_F(Paths, PathsOfAFileGiveTheSamePictureWithoutTracing) {
  // A given radius does not depend on the seeds, which a file of paths does not contain.
  const Settings settings{"integrator.radius.typical=0.04"};
  const Image traced = render(settings, {"out.vtp", "out.ply"});
  const std::string tubes = read_file(in_folder("out.ply")), paths = read_file(in_folder("out.vtp"));
  std::filesystem::rename(in_folder("out.vtp"), in_folder("kept.vtp"));
  Settings again = settings;
  again.push_back("integrator.paths=kept.vtp");
  EXPECT_TRUE(render(again, {"out.vtp", "out.ply"}).pixels == traced.pixels);
  EXPECT_TRUE(read_file(in_folder("out.vtp")) == paths);
  EXPECT_TRUE(read_file(in_folder("out.ply")) == tubes);
}

TEST_F(Paths, FilesOfPathsNeedNoPicture) {
  render({}, {"out.vtp", "out.ply", "out.png"});
  for (const std::string ending : {".ply", ".vtp"}) {
    render_all({}, {"alone" + ending});
    EXPECT_TRUE(read_file(in_folder("alone" + ending)) == read_file(in_folder("out" + ending))) << ending;
  }
  EXPECT_EQ(statistics_["seconds"]["draw"], 0);
}

TEST_F(Paths, WhatAUserCanGetWrong) {
  expect_error(2, "unknown key `/integrator/sedes`; did you mean `seeds`", {"integrator.sedes=3"});
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

}  // namespace
}  // namespace tensorray
