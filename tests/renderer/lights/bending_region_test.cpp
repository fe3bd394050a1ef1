#include "renderer/lights/bending_region.h"

#include "base/constants.h"
#include "renderer/meshes/mesh.h"
#include "tests/renderer/lit_world.h"

namespace tensorray {
namespace {

constexpr int region_bands = 4;

const TestBands& four_bands() {
  static const TestBands result({{620, 60, 0.25, Vector3d(1, 0.3, 0)},
                                 {560, 60, 0.25, Vector3d(0.2, 0.5, 0)},
                                 {500, 60, 0.25, Vector3d(0, 0.15, 0.2)},
                                 {440, 60, 0.25, Vector3d(0.1, 0.05, 0.8)}});
  return result;
}

AreaLight region_lamp() {
  return {rectangle_mesh({0.3, 0, 1.2}, {1, 0, 0}, {0, -1, 0}, {0.8, 0.8}), four_bands().even(5)};
}

TEST(BendingRegionTest, AWhiteFloorInAWhiteSkyCannotBeSeen) {
  const TurningCube cube(0.3);
  FloorWorld stage(four_bands(), cube, Diffuse{}, 1, {ConstantLight{four_bands().even(1)}});
  stage.scene.bands_per_view = stage.scene.bands_per_bounce = region_bands;
  for (const Vector3d& to : {Vector3d(0, 0, 0), Vector3d(0.1, 0, -0.8), Vector3d(0.9, 0.4, -0.8)}) {
    const Mean mean = seen(stage.scene, {}, {0, -3, 1.5}, to, 4000);
    EXPECT_NEAR(mean.mean(), 1, 5 * mean.error() + 1e-9);
  }
}

TEST(BendingRegionTest, BandsThatAreFollowedStandForAll) {
  const TurningCube cube(0.4, 1.5);
  FloorWorld stage(four_bands(), cube, Diffuse{}, 0.6, {region_lamp(), ConstantLight{four_bands().even(0.2f)}});
  std::vector<Mean> means;
  for (const int count : {1, 2, 4}) {
    stage.scene.bands_per_view = stage.scene.bands_per_bounce = count;
    means.push_back(seen(stage.scene, {}, {0, -3, 0.7}, {0, 0, 0.02}, 40000));
  }
  for (std::size_t i = 1; i < means.size(); ++i)
    EXPECT_NEAR(means[i].mean(), means[0].mean(), 4.5 * std::hypot(means[i].error(), means[0].error())) << i;
}

TEST(BendingRegionTest, WhatARaySeesDoesNotDependOnTheOthers) {
  const TurningCube cube(0.4, 1.5);
  FloorWorld stage(four_bands(), cube, Diffuse{}, 0.6, {region_lamp(), ConstantLight{four_bands().even(0.2f)}});
  stage.scene.bands_per_view = 2;
  stage.scene.group_of_light = {0, 1};
  stage.scene.groups = 2;
  std::vector<ViewRay> rays;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Vector3d from(0.2, -3, 0.7),
        to(0.006 * static_cast<double>(i) - 0.9, 0, 0.3 - 0.003 * static_cast<double>(i));
    rays.push_back({from, (to - from).normalized(), {3, i / 4, static_cast<std::uint32_t>(i % 4), 0}});
  }
  RayShader together(stage.scene, {}), alone(stage.scene, {});
  together.shade(rays, true);
  int bent = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    alone.shade({rays[i]}, true);
    EXPECT_TRUE((together.radiance(i) == alone.radiance(0)).all()) << i;
    for (int group = 0; group < 2; ++group) EXPECT_TRUE((together.layer(i, group) == alone.layer(0, group)).all()) << i;
    const RayView &view = together.view(i), &other = alone.view(0);
    ASSERT_EQ(view.bent.has_value(), other.bent.has_value());
    ASSERT_EQ(view.surface.has_value(), other.surface.has_value());
    if (view.surface) {
      EXPECT_EQ(view.surface->hit.position, other.surface->hit.position);
    }
    if (!view.bent) continue;
    EXPECT_EQ(view.bent->deflection, other.bent->deflection);
    ++bent;
  }
  EXPECT_GT(bent, 50);
  EXPECT_LT(bent, 290);
}

/// Rays that do not arrive count as 0 in the sums, and not in the means.
TEST(BendingRegionTest, MeansAreOfTheRaysThatArrive) {
  TurningCube cube(0.01, 1.5);
  cube.lost_band = 3;
  FloorWorld stage(four_bands(), cube, Diffuse{}, 0.6, {ConstantLight{four_bands().even(1)}});
  stage.scene.bands_per_view = region_bands;
  RayShader shader(stage.scene, {});
  shader.shade({{{0, -3, 0}, {0, 1, 0}, {3, 0, 0, 0}}}, true);
  const BentView view = shader.view(0).bent.value();
  EXPECT_EQ(view.arrives, 0.75);
  EXPECT_NEAR(view.radiance_scale / view.arrives, 1.5, 1e-12);
  EXPECT_NEAR(view.deflection / view.arrives, 0.01 * (1 + 2 + 3) / 3, 1e-9);
}

/// A directional light reaches no surface through the region, because landed light has it; the camera still sees it.
TEST(BendingRegionTest, AnIrradianceMapReplacesTheSunBehindTheRegion) {
  const TurningCube cube(0.1);
  FloorWorld stage(four_bands(), cube, Diffuse{}, 0.6, {DirectionalLight{{0, 0, -1}, four_bands().even(2), 0}});
  const auto radiance = [&](const Vector3d& to) { return seen(stage.scene, {}, {0, -3, 1}, to, 100).mean(); };
  const Vector3d below(0.1, 0.1, -0.8), beside(0.9, 0.1, -0.8);
  EXPECT_EQ(radiance(below), 0);
  EXPECT_NEAR(radiance(beside), 2 * 0.6 / pi, 1e-6);

  IrradianceMap landed;
  landed.plate.center = {0, 0, -0.8};
  landed.plate.resolution = {4, 4};
  landed.bands = region_bands;
  landed.irradiance.assign(16 * region_bands, 3);
  stage.scene.irradiance_maps = {landed};
  EXPECT_NEAR(radiance(below), 3 * 0.6 / pi, 1e-6);
  stage.scene.irradiance_maps[0].side = -1;
  EXPECT_EQ(radiance(below), 0);
}

/// A room that emits, about the cube. Every surface sends on half of the light, in all bands alike.
TEST(BendingRegionTest, BentLightIsLimitedInAllBandsAlike) {
  TriangleMesh room = box_mesh({Vector3d(-1, -1, -1), Vector3d(1, 1, 1)}, Eigen::Affine3d::Identity());
  for (auto& triangle : room.triangles) std::swap(triangle[1], triangle[2]);  // They face inwards.
  World world(four_bands(), {surface_of(room, 0, 0)}, {make_material(Diffuse{}, four_bands().grey(0.5))},
              {AreaLight{room, four_bands().even(8)}});
  const TurningCube cube(0.7);
  world.scene.region = &cube;
  ShadingSettings settings;
  settings.direct = DirectLight::material;  // Each contribution is 8 / 2^depth.
  settings.roulette_depth = 100;
  settings.max_depth = 3;
  settings.indirect_clamp = 0.5;
  for (const int count : {1, 2, 4}) {
    world.scene.bands_per_view = world.scene.bands_per_bounce = count;
    EXPECT_NEAR(seen(world.scene, settings, {0.9, 0.1, 0.3}, {0, 0, 0.1}, 200).mean(), 8 + 4 + 0.5 + 0.5, 1e-6)
        << count;
  }
}

}  // namespace
}  // namespace tensorray
