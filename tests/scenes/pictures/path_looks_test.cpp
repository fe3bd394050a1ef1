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

}  // namespace
}  // namespace tensorray
