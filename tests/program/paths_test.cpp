// Path tracing: pictures of the bent rays, as a user sees them.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <regex>
#include <set>
#include <sstream>

#include <Eigen/Core>
#include <gmock/gmock.h>

#include "renderer/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;
using Settings = std::vector<std::string>;

constexpr const char* point_load = R"("kind": "point_load", "resolution": 9)";
constexpr const char* zero = R"("kind": "constant", "resolution": 9, "tensor": [[0, 0, 0], [0, 0, 0], [0, 0, 0]])";

/// A scene that renders in a moment. The volume is from -1 to 1; of the point load, from -2 to 0 along z.
std::string small_paths(const std::string& kind = point_load) {
  return R"({"field": {"generate": {)" + kind + R"(}, "scale": 6},
             "light": {"photons": 500, "wavelengths": {"count": 4}},
             "receiver": {"resolution": [16, 16]},
             "integrator": {"type": "path_tracing", "seeds": {"count": 16}, "max_samples": 4, "noise": 0,
                            "filter": "box"},
             "camera": {"resolution": [24, 16]}})";
}

const std::vector<std::string> all_channels{"R",        "G",        "B",        "A",        "Z",        "normal.X",
                                            "normal.Y", "normal.Z", "albedo.R", "albedo.G", "albedo.B", "path",
                                            "force",    "length",   "samples",  "variance"};

/// The named channel of a picture, by pixel.
std::vector<float> channel(const Image& image, const std::string& name) {
  const auto found = std::find(image.channels.begin(), image.channels.end(), name);
  if (found == image.channels.end()) {
    ADD_FAILURE() << "no channel " << name;
    return {};
  }
  std::vector<float> values;
  for (auto i = static_cast<std::size_t>(found - image.channels.begin()); i < image.pixels.size();
       i += image.channels.size())
    values.push_back(image.pixels[i]);
  return values;
}

double sum(const std::vector<float>& values) {
  double total = 0;
  for (const float value : values) total += static_cast<double>(value);
  return total;
}

float greatest(const std::vector<float>& values) { return *std::max_element(values.begin(), values.end()); }

void expect_finite(const Image& image, const std::string& what) {
  for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value)) << what;
}

/// How much of the picture is covered, in pixels.
double covered(const Image& image) { return sum(channel(image, "A")); }

constexpr const char* seen_from_the_side =
    R"(camera={"position": [0, -6, 2], "target": [0, 0, -1], "resolution": [24, 16]})";
constexpr const char* transparent = "integrator.background=transparent";
constexpr const char* without_box = "integrator.context.box=false";

class Paths : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("scene.json", small_paths());
  }

  static std::vector<std::string> arguments(const Settings& outputs, const Settings& settings) {
    std::vector<std::string> result{"render", "scene.json", "-q"};
    for (const std::string& output : outputs) result.insert(result.end(), {"-o", output});
    for (const std::string& setting : settings) result.insert(result.end(), {"--set", setting});
    return result;
  }

  /// The scene-linear picture; all of its values are finite.
  Image render(const Settings& settings, Settings outputs = {}) {
    outputs.push_back("out.exr");
    run_well(arguments(outputs, settings));
    Image image = read_image(in_folder("out.exr"));
    expect_finite(image, settings.empty() ? "" : settings.back());
    return image;
  }

  /// The program must fail with one line that matches `pattern`, and must leave nothing.
  void expect_error(int status, const std::string& pattern, const Settings& settings,
                    const Settings& outputs = {"out.png", "out.exr", "out.vtp", "out.ply"}) {
    const auto before = files();
    const Outcome outcome = run(arguments(outputs, settings));
    EXPECT_EQ(outcome.status, status) << outcome.error;
    EXPECT_TRUE(std::regex_search(outcome.error, std::regex(pattern))) << outcome.error << "\nexpected " << pattern;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_EQ(files(), before);
  }

  /// Positions of an .obj file's vertices.
  std::vector<Eigen::Vector3d> vertices(const std::string& name) {
    std::istringstream text(read_file(in_folder(name)));
    std::vector<Eigen::Vector3d> positions;
    for (std::string line; std::getline(text, line);) {
      std::istringstream words(line);
      std::string word;
      Eigen::Vector3d position;
      if (words >> word && word == "v" && words >> position.x() >> position.y() >> position.z())
        positions.push_back(position);
    }
    return positions;
  }
};

TEST_F(Paths, APictureWithEveryChannel) {
  const Image image = render({}, {"out.png"});
  EXPECT_THAT(image.channels, ::testing::UnorderedElementsAreArray(all_channels));
  EXPECT_EQ(image.width, 24);
  EXPECT_EQ(image.height, 16);
  const Image shown = read_image(in_folder("out.png"));
  EXPECT_EQ(shown.width, 24);
  EXPECT_LT(*std::min_element(shown.pixels.begin(), shown.pixels.end()), 0.7f) << "something is on the white ground";
  EXPECT_THAT(files(), ::testing::UnorderedElementsAre("out.exr", "out.png", "scene.json"));
}

TEST_F(Paths, AuxiliaryPlanesSayWhatTheyShould) {
  // Seen along y. Of the tubes and the box first, then of the tubes alone.
  const Settings settings{transparent, "camera.projection=orthographic", "camera.direction=[0,1,0]"};
  const Image with_box = render(settings);
  const std::vector<float> any = channel(with_box, "A"), id = channel(with_box, "path"),
                           force = channel(with_box, "force");
  bool box_seen = false;
  for (std::size_t i = 0; i < any.size(); ++i) {
    EXPECT_EQ(id[i], std::floor(id[i]));
    EXPECT_GE(id[i], -1);
    EXPECT_LT(id[i], 16);
    EXPECT_EQ(force[i] > 0, id[i] >= 0) << i;
    if (any[i] == 0) {
      EXPECT_EQ(id[i], -1) << i;
    }
    box_seen = box_seen || (any[i] > 0 && id[i] == -1);
  }
  EXPECT_TRUE(box_seen);

  Settings alone = settings;
  alone.push_back(without_box);
  const Image image = render(alone);
  const std::vector<float> alpha = channel(image, "A"), depth = channel(image, "Z"), path = channel(image, "path"),
                           length = channel(image, "length"), variance = channel(image, "variance");
  std::set<float> ids;
  double normal_lengths = 0, tubes = 0;
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    EXPECT_EQ(path[i] >= 0, alpha[i] > 0) << i;
    EXPECT_TRUE(depth[i] > 0 || alpha[i] == 0) << i;
    EXPECT_GE(length[i], 0);
    EXPECT_LT(length[i], 4);
    EXPECT_GE(variance[i], 0);
    EXPECT_EQ(channel(image, "force")[i] > 0, alpha[i] > 0) << i;
    if (alpha[i] == 0) continue;
    ids.insert(path[i]);
    const Eigen::Vector3f normal(channel(image, "normal.X")[i], channel(image, "normal.Y")[i],
                                 channel(image, "normal.Z")[i]);
    EXPECT_LE(normal.norm(), 1.0001f);
    EXPECT_LT(normal.y(), 0) << "towards the viewer";
    normal_lengths += static_cast<double>(normal.norm());
    ++tubes;
    for (const char* name : {"albedo.R", "albedo.G", "albedo.B"}) {
      EXPECT_GE(channel(image, name)[i], 0);
      EXPECT_LE(channel(image, name)[i], 1);
    }
  }
  EXPECT_GE(ids.size(), 4u);
  EXPECT_GT(normal_lengths / tubes, 0.7) << "means of unit vectors";
  EXPECT_GT(greatest(length), 1);
}

TEST_F(Paths, PixelsHaveBetweenTheLeastAndTheMostSamples) {
  const Image image = render({"integrator.min_samples=4", "integrator.max_samples=16", "integrator.noise=0.1"});
  const std::vector<float> samples = channel(image, "samples");
  for (const float count : samples) {
    EXPECT_GE(count, 4);
    EXPECT_LE(count, 16);
  }
  EXPECT_EQ(*std::min_element(samples.begin(), samples.end()), 4) << "the ground is done at once";
  EXPECT_GT(greatest(samples), 4);
  for (const float count : channel(render({"integrator.min_samples=1", "integrator.max_samples=3"}), "samples"))
    EXPECT_EQ(count, 3);
}

TEST_F(Paths, TheSameBytesOnAnyNumberOfThreads) {
  const Settings names{"out.png", "out.exr", "out.spectral.exr", "out.vtp", "out.ply"};
  std::vector<std::vector<std::string>> contents;
  for (const std::string threads : {"1", "2", "8"}) {
    std::vector<std::string> all =
        arguments(names, {"integrator.context.plate=true", "integrator.context.slice={}", "camera.lens_radius=0.1",
                          "integrator.min_samples=2", "integrator.noise=0.1", "integrator.seeds.kind=poisson_disk"});
    all.insert(all.end(), {"--threads", threads});
    run_well(all);
    contents.emplace_back();
    for (const std::string& name : names) contents.back().push_back(read_file(in_folder(name)));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_TRUE(contents[0][i] == contents[1][i]) << names[i];
    EXPECT_TRUE(contents[0][i] == contents[2][i]) << names[i];
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
    const Image image = render({"integrator.seeds.kind=" + kind, "integrator.seeds.file=seeds.txt",
                                "integrator.seeds.above=0.5", transparent, without_box},
                               {"out.tck"});
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

TEST_F(Paths, LightIsFollowedBackFromSeedsWithinTheVolume) {
  // Straight through the volume, from face to face: 2 long. Without backwards they begin near the middle.
  write("scene.json", small_paths(zero));
  const Settings settings{"integrator.seeds.kind=sphere", "integrator.seeds.radius=0.3", without_box};
  EXPECT_NEAR(greatest(channel(render(settings), "length")), 2, 0.2);
  Settings forwards = settings;
  forwards.push_back("integrator.backwards=false");
  const float length = greatest(channel(render(forwards), "length"));
  EXPECT_LT(length, 1.35f);
  EXPECT_GT(length, 0.7f);
  Settings outside = settings;
  outside.push_back("integrator.outside=true");
  EXPECT_GT(greatest(channel(render(outside), "length")), 2.3f);
}

TEST_F(Paths, PathsOfAFileGiveTheSamePictureWithoutTracing) {
  // Without a radius it would be chosen by the distance between seeds, which no file of paths tells.
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

TEST_F(Paths, TracksAreWrittenAndRead) {
  const Settings settings{"integrator.style=lines", "integrator.radius.typical=0.04", transparent};
  const Image traced = render(settings, {"out.tck"});
  EXPECT_EQ(read_file(in_folder("out.tck")).compare(0, 14, "mrtrix tracks\n"), 0);
  std::filesystem::rename(in_folder("out.tck"), in_folder("kept.tck"));
  Settings again = settings;
  again.push_back("integrator.paths=kept.tck");
  const Image read = render(again);
  EXPECT_NEAR(covered(read), covered(traced), 0.5);  // Single precision.
  EXPECT_EQ(greatest(channel(read, "force")), 0) << "tracks hold no tensors";
}

TEST_F(Paths, TubesAreObstaclesOfAnotherScene) {
  run_well(arguments({"tube.ply"}, {"integrator.seeds.count=1", "integrator.radius.typical=0.1"}));
  EXPECT_EQ(read_file(in_folder("tube.ply")).compare(0, 4, "ply\n"), 0);
  const Settings settings{R"(obstacles=[{"file": "tube.ply"}])", transparent, seen_from_the_side, without_box};
  Settings hiding = settings;
  hiding.push_back("integrator.context.obstacles=false");
  EXPECT_GT(covered(render(settings)), covered(render(hiding)) + 1);
}

TEST_F(Paths, ContextIsShown) {
  const Settings from_here{transparent, seen_from_the_side};
  const auto with = [&](const std::string& setting) {
    Settings settings = from_here;
    settings.push_back(setting);
    return render(settings);
  };
  const double plain = covered(render(from_here));
  EXPECT_LT(covered(with(without_box)), plain - 1);
  std::vector<Image> pictures;
  for (const std::string& setting :
       {std::string("integrator.context.plate=true"), std::string("integrator.context.slice={}"),
        std::string(R"(integrator.context.isosurfaces=[{"invariant": "norm", "value": 1}])")}) {
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
  const auto corner = [&](const std::vector<std::string>& settings) {
    const Image image = render(settings);
    return Eigen::Vector4f(channel(image, "R")[0], channel(image, "G")[0], channel(image, "B")[0],
                           channel(image, "A")[0]);
  };
  EXPECT_LT((corner({}) - Eigen::Vector4f(1, 1, 1, 1)).norm(), 1e-4f);
  EXPECT_LT((corner({"integrator.background_color=[0.2,0.2,0.2]"}) - Eigen::Vector4f(0.2f, 0.2f, 0.2f, 1)).norm(),
            1e-4f);
  EXPECT_EQ(corner({transparent}), Eigen::Vector4f(0, 0, 0, 0));
  const Eigen::Vector4f sky =
      corner({"integrator.background=lights", R"(lights=[{"kind": "constant", "strength": 0.3}])"});
  EXPECT_LT((sky - Eigen::Vector4f(0.3f, 0.3f, 0.3f, 1)).norm(), 2e-3f);
}

TEST_F(Paths, Cameras) {
  // What an orthographic camera sees does not depend on its distance.
  const auto seen = [&](int distance) {
    return render({transparent, "camera.projection=orthographic", "camera.target=[0,0,0]", "camera.height=3",
                   "camera.position=[0,-" + std::to_string(distance) + ",0]"});
  };
  const Image near = seen(4), far = seen(6);
  EXPECT_NEAR(covered(near), covered(far), 0.5);
  const std::vector<float> near_depth = channel(near, "Z"), far_depth = channel(far, "Z");
  for (std::size_t i = 0; i < near_depth.size(); ++i)
    if (channel(near, "A")[i] == 1 && channel(far, "A")[i] == 1) {
      EXPECT_NEAR(far_depth[i] - near_depth[i], 2, 0.3);
    }
  // A thin lens: sharp at the focus alone.
  const auto partly_covered = [&](const std::string& lens) {
    const Image image = render({transparent, without_box, "integrator.max_samples=16", "camera.lens_radius=" + lens,
                                "camera.focus_distance=1", "camera.direction=[0,1,0]"});
    const std::vector<float> alpha = channel(image, "A");
    return std::count_if(alpha.begin(), alpha.end(), [](float value) { return value > 0 && value < 1; });
  };
  EXPECT_GT(partly_covered("0.3"), partly_covered("0") + 20);
}

TEST_F(Paths, LightsOfEveryKind) {
  Image sky(8, 4, {"R", "G", "B"});
  std::fill(sky.pixels.begin(), sky.pixels.end(), 1.0f);
  write_image(in_folder("white.exr"), sky);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 8; ++x) sky.pixel(x, y)[x < 4 ? 1 : 0] = sky.pixel(x, y)[2] = 0;
  write_image(in_folder("two.exr"), sky);
  const auto lit = [&](const std::string& light) {
    return render({transparent, without_box, seen_from_the_side, "integrator.material.kind=diffuse",
                   "integrator.max_depth=1", "integrator.color.by=none", "integrator.max_samples=16",
                   "lights=[{" + light + "}]"});
  };
  const auto red = [](const Image& image) { return sum(channel(image, "R")); };
  const auto green = [](const Image& image) { return sum(channel(image, "G")); };
  std::vector<Image> pictures;
  for (const std::string light : {R"("kind": "constant")", R"("kind": "directional", "direction": [0, 1, -1])",
                                  R"("kind": "area", "center": [0, -3, 3], "direction": [0, 1, -1], "size": [3, 3])",
                                  R"("kind": "environment", "file": "white.exr")"}) {
    pictures.push_back(lit(light));
    EXPECT_GT(red(pictures.back()), 0.1) << light;
    // Twice as strong, but reddish.
    const Image reddish = lit(light + R"(, "strength": 2, "color": [1, 0.1, 0.1])");
    EXPECT_NEAR(red(reddish) / red(pictures.back()), 2, 0.1) << light;
    EXPECT_NEAR(green(reddish) / green(pictures.back()), 0.2, 0.05) << light;
  }
  EXPECT_NEAR(red(pictures.back()) / red(pictures.front()), 1, 0.02) << "all white";
  const std::string two = R"("kind": "environment", "file": "two.exr")";
  const Image straight = lit(two);
  const Image turned = lit(two + R"(, "rotation": 180)");
  EXPECT_LT(std::abs(std::log(red(straight) * red(turned) / green(straight) / green(turned))), 1)
      << "the halves change places";
}

TEST_F(Paths, MaterialsOfEveryKind) {
  std::set<std::vector<float>> pictures;
  for (const std::string material :
       {R"("kind": "diffuse")", R"("kind": "principled")", R"("kind": "principled", "clearcoat": 1)",
        R"("kind": "metal", "metal": "copper")", R"("kind": "glass")"}) {
    const Image image =
        render({"integrator.material={" + material + "}", without_box, "integrator.radius.typical=0.1"});
    pictures.insert(channel(image, "R"));
  }
  EXPECT_EQ(pictures.size(), 5u);
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

TEST_F(Paths, TheLegendIsDrawnIntoThePictureAlone) {
  // From here nothing depends on the room that a chosen camera leaves for a legend.
  const Settings settings{seen_from_the_side, "camera.resolution=[240,160]", "integrator.max_samples=1"};
  for (const std::string by : {"force", "direction"}) {
    Settings colored = settings, explained = settings;
    colored.push_back("integrator.color.by=" + by);
    explained.insert(explained.end(), {"integrator.color.by=" + by, "integrator.color.legend=true"});
    const Image without = render(colored, {"out.png"});
    const Image without_shown = read_image(in_folder("out.png"));
    EXPECT_TRUE(render(explained, {"out.png"}).pixels == without.pixels) << by;
    const Image shown = read_image(in_folder("out.png"));
    int left = 0, right = 0;
    for (int y = 0; y < shown.height; ++y)
      for (int x = 0; x < shown.width; ++x)
        if (shown.pixel(x, y)[1] != without_shown.pixel(x, y)[1]) ++(x < shown.width / 2 ? left : right);
    EXPECT_EQ(left, 0) << by;
    EXPECT_GT(right, 200) << by;
  }
}

TEST_F(Paths, SpectraAreWritten) {
  run_well(arguments({"out.spectral.exr"}, {"integrator.bands=8"}));
  const Image image = read_image(in_folder("out.spectral.exr"));
  EXPECT_GE(image.channels.size(), 8u);
  EXPECT_EQ(std::count_if(image.channels.begin(), image.channels.end(),
                          [](const std::string& name) { return name.find("nm") != std::string::npos; }),
            8);
  expect_finite(image, "spectra");
  EXPECT_GT(greatest(image.pixels), 0);
}

TEST_F(Paths, WithoutAFieldTheyAreStraightRoundAndOfTheTypicalRadius) {
  write("scene.json", small_paths(zero));
  for (const std::string from : {"[0,-5,0]", "[5,0,0]"}) {
    const Image image =
        render({"integrator.seeds.count=1", "integrator.radius.typical=0.1", "integrator.caps=flat", without_box,
                transparent, "camera.projection=orthographic", "camera.position=" + from, "camera.target=[0,0,0]",
                "camera.height=1", "camera.resolution=[40,40]", "integrator.max_samples=16"},
               {"tube.obj"});
    // 0.2 of a picture that is 1 high and has 40 pixels.
    const std::vector<float> alpha = channel(image, "A");
    for (int row = 0; row < 40; ++row)
      EXPECT_NEAR(std::accumulate(alpha.begin() + 40 * row, alpha.begin() + 40 * (row + 1), 0.0), 8, 0.5)
          << from << " " << row;
  }
  double farthest = 0;
  for (const Eigen::Vector3d& vertex : vertices("tube.obj")) {
    farthest = std::max(farthest, std::abs(vertex.head<2>().norm() - 0.1));
    EXPECT_NEAR(std::abs(vertex.z()), 1, 1e-6);  // A straight tube needs no ring between its ends.
  }
  EXPECT_LT(farthest, 1e-6);
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
