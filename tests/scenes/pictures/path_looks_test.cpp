// Path tracing: surroundings, lights and cameras of pictures of bent rays.

#include <set>

#include <Eigen/Core>

#include "tests/scenes/pictures/paths_support.h"

namespace tensorray {
namespace {

using namespace test;

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
    // Twice as strong, and reddish.
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
  // A given camera leaves no space for a legend, so that both pictures show the same.
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
  render({"integrator.bands=8"}, {"out.spectral.exr"});
  const Image image = read_image(in_folder("out.spectral.exr"));
  EXPECT_GE(image.channels.size(), 8u);
  EXPECT_EQ(std::count_if(image.channels.begin(), image.channels.end(),
                          [](const std::string& name) { return name.find("nm") != std::string::npos; }),
            8);
  expect_finite(image, "spectra");
  EXPECT_GT(greatest(image.pixels), 0);
}

}  // namespace
}  // namespace tensorray
