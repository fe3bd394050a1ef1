#include "renderer/camera/path_tracer.h"

#include <atomic>
#include <chrono>
#include <numeric>
#include <thread>
#include <utility>

#include <Eigen/LU>

#include "base/constants.h"
#include "base/process/job.h"
#include "renderer/meshes/mesh.h"
#include "renderer/sampling/random.h"
#include "tests/renderer/lit_world.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

/// Three bands whose colours are red, green and blue.
const TestBands& rgb() {
  static const TestBands bands = [] {
    const std::vector<Band> all{
        {610, 80, 0.3, Vector3d(1, 0.3, 0)}, {545, 80, 0.4, Vector3d(0, 0.6, 0)}, {460, 80, 0.3, Vector3d(0, 0.1, 1)}};
    Matrix3d to_xyz;
    for (int i = 0; i < 3; ++i) to_xyz.col(i) = all[static_cast<std::size_t>(i)].xyz;
    return TestBands(all, to_xyz.inverse());
  }();
  return bands;
}

BandValues grey(double value) { return rgb().grey(value); }
std::vector<float> even(float value) { return rgb().even(value); }

RoughConductor mirror(double roughness) { return {roughness, {BandValues::Zero(3), BandValues::Ones(3)}}; }

TriangleMesh floor_mesh(double size) { return rectangle_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {size, size}); }

/// Deep enough for all light; without noise from Russian roulette at the first bounces.
ShadingSettings deep() {
  ShadingSettings settings;
  settings.max_depth = 200;
  return settings;
}

TEST(FurnaceTest, WhiteThingsInAWhiteSkyCannotBeSeen) {
  std::vector<std::pair<std::string, Material>> whites{
      {"diffuse", make_material(Diffuse{}, grey(1))},
      {"mirror", make_material(mirror(0.3), grey(1))},
      {"plastic", make_material(Principled{0, 0.3, 0.5, 0.5, 0.1}, grey(1))},
      {"metal", make_material(Principled{1, 0.5, 0.5, 0, 0.1}, grey(1))},
      {"glass", make_material(RoughDielectric{0.2, 1.5}, grey(1))}};
  for (const auto& [name, material] : whites) {
    // A coarse sphere with smooth normals on a floor, for interreflection and silhouettes.
    ShadedSurface coarse = sphere(8);
    TriangleMesh ground = rectangle_mesh({0, 0, -1.1}, {1, 0, 0}, {0, 1, 0}, {6, 6});
    const World world(rgb(), {coarse, surface_of(ground, 1)}, {material, make_material(Diffuse{}, grey(1))},
                      {ConstantLight{even(1)}});
    for (const Vector3d& target : {Vector3d(0, 0, 0), Vector3d(0.7, 0, 0.65), Vector3d(0.6, -0.5, -0.9)}) {
      const Mean mean = seen(world.scene, deep(), {0.3, -4, 1}, target, 1500);
      // White materials return all light up to 2e-3 per bounce; glass up to 1e-2 near the horizon.
      EXPECT_NEAR(mean.mean(), 1, 4 * mean.error() + (name == "glass" ? 0.03 : 0.01)) << name << target.transpose();
      EXPECT_LT(mean.error(), 0.03) << name;
    }
  }
}

TEST(FurnaceTest, GreyBoxHasTheGeometricSeries) {
  // In a closed box of reflectance ρ whose walls emit radiance e, the radiance is e / (1 − ρ) everywhere.
  TriangleMesh box = box_mesh({Vector3d(-1, -1, -1), Vector3d(1, 2, 1)}, Affine3d::Identity());
  for (auto& triangle : box.triangles) std::swap(triangle[1], triangle[2]);  // They face inwards.
  const World world(rgb(), {surface_of(box, 0, 0)}, {make_material(Diffuse{}, grey(0.6))},
                    {AreaLight{box, even(0.5f)}});
  for (const DirectLight direct : {DirectLight::both, DirectLight::lights, DirectLight::material}) {
    ShadingSettings settings = deep();
    settings.direct = direct;
    settings.indirect_clamp = 0;
    const Mean mean = seen(world.scene, settings, {0.2, 0.1, 0.3}, {1, 0.7, 0.2}, 3000);
    EXPECT_NEAR(mean.mean(), 0.5 / 0.4, 4 * mean.error());
    // Sampling only lights makes noise in the corners.
    EXPECT_LT(mean.error(), direct == DirectLight::lights ? 0.1 : 0.02);
  }
  ShadingSettings twice;
  twice.max_depth = 2;
  const Mean mean = seen(world.scene, twice, {0.2, 0.1, 0.3}, {1, 0.7, 0.2}, 3000);
  EXPECT_NEAR(mean.mean(), 0.5 * (1 + 0.6 + 0.36), 4 * mean.error());
}

TEST(DirectLightTest, OcclusionHidesWhatIsBehind) {
  const AreaLight lamp{rectangle_mesh({0, 0, 3}, {1, 0, 0}, {0, -1, 0}, {1, 1}), even(1)};
  // The plate hides the half of the lamp with x > 0 from the origin.
  const TriangleMesh plate = rectangle_mesh({1, 0, 1.5}, {1, 0, 0}, {0, 1, 0}, {2, 4});
  const World world(rgb(), {surface_of(floor_mesh(10)), surface_of(lamp.mesh, 0, 0), surface_of(plate)},
                    {make_material(Diffuse{}, grey(1))}, {lamp});
  ShadingSettings settings;
  settings.max_depth = 1;
  const std::vector<Vector3d> half{{-0.5, -0.5, 3}, {0, -0.5, 3}, {0, 0.5, 3}, {-0.5, 0.5, 3}};
  const Mean mean = seen(world.scene, settings, {-2, -1, 0.5}, {0, 0, 0}, 4000);
  EXPECT_NEAR(mean.mean(), polygon_irradiance(half, {0, 0, 0}, {0, 0, 1}) / pi, 4 * mean.error());
}

TEST(MultipleImportanceSamplingTest, HasTheMeanOfEachStrategy) {
  const AreaLight small{rectangle_mesh({0, 0.5, 2}, {1, 0, 0}, {0, -1, 0}, {0.6, 0.6}), even(20)};
  const AreaLight large{rectangle_mesh({-2, 0, 1.5}, {0, 1, 0}, {0, 0, 1}, {3, 2.9}), even(1)};
  for (const double roughness : {0.3, 0.6}) {
    const World world(
        rgb(), {surface_of(floor_mesh(8)), surface_of(small.mesh, 1, 0), surface_of(large.mesh, 1, 1)},
        {make_material(Principled{0.3, roughness, 0.5, 0.5, 0.3}, grey(0.6)), make_material(Diffuse{}, grey(0.5))},
        {small, large, ConstantLight{even(0.2f)}});
    ShadingSettings settings;
    settings.max_depth = 3;
    settings.indirect_clamp = 0;
    const auto mean_of = [&](DirectLight direct) {
      settings.direct = direct;
      return seen(world.scene, settings, {0.4, -2.5, 1.6}, {0.1, -0.6, 0}, 12000);
    };
    const Mean both = mean_of(DirectLight::both);
    for (const DirectLight direct : {DirectLight::lights, DirectLight::material}) {
      const Mean single = mean_of(direct);
      EXPECT_NEAR(single.mean(), both.mean(), 4 * std::hypot(single.error(), both.error()));
      EXPECT_LT(both.error(), 1.1 * single.error());
    }
    EXPECT_LT(both.error(), 0.02 * both.mean());
  }
}

TEST(ShadingNormalTest, SmoothSpheresHaveNoFringesAndDoNotLeak) {
  // The sun is behind the viewer, then beside. The shading of a Lambertian sphere follows the smooth normal.
  for (const Vector3d& travels : {Vector3d(0, 1, 0), Vector3d(1, 0.2, 0)}) {
    const World world(rgb(), {sphere(10)}, {make_material(Diffuse{}, grey(1))},
                      {DirectionalLight{travels, even(1), 0}});
    ShadingSettings settings;
    settings.max_depth = 1;
    RayShader shader(world.scene, settings);
    for (int i = 0; i < 2000; ++i) {
      const double x = -1 + 2 * random_uniform(2, i, 0), z = -1 + 2 * random_uniform(2, i, 1);
      shader.shade({{{x, -5, z}, {0, 1, 0}, {}}}, false);
      const auto& surface = shader.view(0).surface;
      if (!surface) continue;
      const double cosine = -surface->normal.dot(travels.normalized());
      EXPECT_LT(surface->normal.y(), 0);  // The viewer is above the surface.
      EXPECT_NEAR(shader.radiance(0)[0] * pi, std::max(0.0, cosine), 1e-6) << x << " " << z;
    }
  }
}

TEST(PreviewTest, HasItsClosedForms) {
  const World plane(rgb(), {surface_of(floor_mesh(4))}, {make_material(Diffuse{}, grey(0.8))}, {});
  ShadingSettings settings;
  settings.shading = Shading::headlight;  // The cosine to the viewer.
  for (const double z : {4, -4})
    EXPECT_NEAR(seen(plane.scene, settings, {0, -3, z}, {0, 0, 0}, 1).mean(), 0.8 * 0.8, 1e-12) << z;

  settings.shading = Shading::ambient_occlusion;
  EXPECT_NEAR(seen(plane.scene, settings, {0, -3, 1}, {0, 0, 0}, 100).mean(), 0.8, 1e-12);
  // A high wall hides half of the sky from its foot. At a distance it hides (1 − cos θ) / 2, where θ is the elevation
  // of its upper edge.
  const TriangleMesh wall = rectangle_mesh({0, 1, 1}, {1, 0, 0}, {0, 0, 1}, {4000, 2});
  const World corner(rgb(), {surface_of(floor_mesh(4)), surface_of(wall)}, plane.materials, {});
  const Mean mean = seen(corner.scene, settings, {0, -3, 1}, {0, 0, 0}, 4000);
  EXPECT_NEAR(mean.mean(), 0.8 * (1 - (1 - std::sqrt(0.2)) / 2), 4 * mean.error() + 1e-3);
}

/// A sphere with data on a floor, lit by a lamp and a dim sky.
World still_life() {
  ShadedSurface ball = sphere(16);
  for (const Vector3f& n : ball.normals) {
    ball.colors.emplace_back(0.7f, 0.4f, 0.2f + 0.1f * n.z());
    ball.forces.push_back(2);
    ball.arc_lengths.push_back(n.z());
  }
  ball.path_ends = {static_cast<std::uint32_t>(std::get<TriangleMesh>(ball.shape).triangles.size())};
  ball.first_path = 5;
  const AreaLight lamp{rectangle_mesh({2, -2, 4}, {1, 0, 0}, {0, -1, 0}, {1.5, 1.5}), even(6)};
  TriangleMesh ground = floor_mesh(10);
  for (Vector3d& p : ground.vertices) p.z() = -1;
  return World(rgb(), {ball, surface_of(ground, 1), surface_of(lamp.mesh, 1, 0)},
               {make_material(Principled{}, grey(0.5)), make_material(Diffuse{}, grey(0.5))},
               {lamp, ConstantLight{even(0.3f)}});
}

class PictureTest : public ::testing::Test {
 protected:
  const World world = still_life();
  PathTracerSettings settings;
  RenderCallbacks callbacks;
};

Camera camera(int size) { return perspective_camera({0, -6, 1}, {0, 0, 0}, {0, 0, 1}, 30, {size, size}); }

std::vector<int> samples_of(const SurfacePicture& picture) {
  std::vector<int> samples;
  for (const PixelState& pixel : picture.pixels) samples.push_back(pixel.samples);
  return samples;
}

/// Without time, each pixel gets its first samples, whoever renders its tile; with more than it takes, it gets all.
TEST_F(PictureTest, TimeLimitsTheSamples) {
  settings.min_samples = settings.pass_samples = 6;
  settings.max_samples = 12;
  const SurfacePicture all = render_surfaces(world.scene, camera(20), settings);
  settings.max_seconds = 1e9;
  settings.first_samples = 2;
  const SurfacePicture in_time = render_surfaces(world.scene, camera(20), settings);
  EXPECT_EQ(samples_of(in_time), samples_of(all));
  EXPECT_THAT(in_time.radiance.values, testing::Pointwise(testing::DoubleNear(1e-12), all.radiance.values));

  settings.max_seconds = 0;
  Job shard({1, 2});
  shard.is_shard = true;
  callbacks.job = &shard;
  const SurfacePicture part = render_surfaces(world.scene, camera(20), settings, callbacks);
  EXPECT_EQ(shard.results().size(), 2u);
  const std::vector<int> samples = samples_of(part);
  EXPECT_EQ(*std::max_element(samples.begin(), samples.end()), 2);
  EXPECT_EQ(samples_of(render_surfaces(world.scene, camera(20), settings)), std::vector<int>(20 * 20, 2));
}

/// A checkpoint has colours alone unless the bands are wanted; a shard has both. Whoever continues, the picture is the
/// same; tiles without bands that are wanted now are rendered again.
TEST_F(PictureTest, KeepsBandsWhereTheyAreWanted) {
  settings.min_samples = settings.max_samples = 4;
  const SurfacePicture all = render_surfaces(world.scene, camera(20), settings);
  std::size_t sizes[2] = {};
  for (const bool is_shard : {false, true}) {
    Job job;
    job.is_shard = is_shard;
    callbacks.job = &job;
    settings.spectral = false;
    EXPECT_TRUE(render_surfaces(world.scene, camera(20), settings, callbacks).radiance.values.empty());
    for (const auto& [name, bytes] : job.results()) sizes[is_shard ? 1 : 0] += bytes->size();
    for (const bool spectral : {true, false}) {
      settings.spectral = spectral;
      Job next({}, job.results());
      callbacks.job = &next;
      const SurfacePicture picture = render_surfaces(world.scene, camera(20), settings, callbacks);
      EXPECT_EQ(picture.color.values, all.color.values);
      EXPECT_EQ(picture.radiance.values, spectral ? all.radiance.values : std::vector<double>());
      EXPECT_EQ(next.results() == job.results(), is_shard || !spectral);
    }
  }
  EXPECT_LT(sizes[0] + 20 * 20 * 3 * 4, sizes[1]);  // Three bands.
}

TEST_F(PictureTest, IsCancelledWithinATile) {
  settings.min_samples = settings.max_samples = 1 << 20;
  std::atomic<bool> cancelled{false};
  Job job;
  callbacks.cancelled = &cancelled;
  callbacks.job = &job;
  callbacks.progress = [&](std::uint64_t, std::uint64_t) { job.stopping = true; };
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    cancelled = true;
  });
  for (const PixelState& pixel : render_surfaces(world.scene, camera(40), settings, callbacks).pixels)
    EXPECT_EQ(pixel.samples, 0);
  later.join();
  EXPECT_TRUE(job.results().empty());
}

TEST_F(PictureTest, AdaptiveSamplingKeepsTheMeanAndWorksWhereItIsNoisy) {
  settings.min_samples = settings.pass_samples = 16;
  settings.max_samples = 128;
  const SurfacePicture full = render_surfaces(world.scene, camera(32), settings);
  settings.noise_threshold = 0.06;
  settings.seed = 1;
  const SurfacePicture adaptive = render_surfaces(world.scene, camera(32), settings);
  const auto sum = [](const auto& values) { return std::accumulate(values.begin(), values.end(), 0.0); };
  const double samples = sum(samples_of(adaptive)), pixels = 32 * 32;
  EXPECT_LT(samples, 0.7 * 128 * pixels);
  EXPECT_GT(samples, 17 * pixels);
  // Error of the mean over the picture, from the variances of the pixels (of the luminance, which is nearly common to
  // all bands).
  double variance = 0;
  for (const SurfacePicture* picture : {&full, &adaptive})
    for (const PixelState& pixel : picture->pixels) variance += pixel.variance();
  const double error = std::sqrt(variance) / pixels;
  EXPECT_NEAR(sum(adaptive.radiance.values) / pixels / 3, sum(full.radiance.values) / pixels / 3, 5 * error);

  Mean many, few;  // Noise of pixels with many samples and with few.
  for (std::size_t i = 0; i < adaptive.pixels.size(); ++i)
    (adaptive.pixels[i].samples > 64 ? many : few).add(full.pixels[i].variance());
  ASSERT_GT(std::min(many.count(), few.count()), 5);
  EXPECT_GT(many.mean(), 1.5 * few.mean());
}

TEST_F(PictureTest, AuxiliaryPlanesAreThoseOfTheFirstSurface) {
  settings.min_samples = settings.max_samples = 16;
  settings.filter = PixelFilter(PixelFilterShape::box);
  settings.transparent = true;
  const Camera view = orthographic_camera({0, -6, 0}, {0, 0, 0}, {0, 0, 1}, 4, {40, 40});
  const SurfacePicture picture = render_surfaces(world.scene, view, settings);
  // Pixel (20, 20) is 0.05 right of the middle and 0.05 below it. Coarse triangles are up to 0.01 below the sphere.
  const std::size_t middle = 20 * 40 + 20, sky = 2 * 40 + 2, ground = 38 * 40 + 3;
  const PixelState &ball = picture.pixels[middle], &empty = picture.pixels[sky];
  EXPECT_EQ(picture.alpha(middle), 1);
  EXPECT_NEAR(ball.depth.value[0], 5, 0.02);
  EXPECT_LT((ball.normal.get() - Vector3f(0.05f, -1, -0.05f)).norm(), 0.01);
  EXPECT_LT((ball.albedo.get() - Vector3f(0.7f, 0.4f, 0.195f)).norm(), 2e-3);
  EXPECT_EQ(ball.path, 5);
  EXPECT_EQ(ball.force.value[0], 2);
  EXPECT_NEAR(ball.arc_length.value[0], -0.05, 0.01);
  EXPECT_EQ(ball.samples, 16);
  EXPECT_GT(ball.variance(), 0);

  EXPECT_EQ(picture.alpha(sky), 0);
  EXPECT_EQ(empty.depth.value[0], 0);
  EXPECT_EQ(empty.path, -1);
  EXPECT_EQ(picture.radiance.plane(0)[sky], 0);
  EXPECT_EQ(picture.alpha(ground), 0);  // The floor is seen edge-on.

  settings.transparent = false;
  const SurfacePicture opaque = render_surfaces(world.scene, view, settings);
  EXPECT_EQ(opaque.alpha(sky), 1);
  EXPECT_NEAR(opaque.radiance.plane(0)[sky], 0.3, 1e-6);
  // At the edge of the sphere, values are averages over the part of the pixel that hits it.
  for (const PixelState& pixel : picture.pixels)
    if (pixel.path == 5) {
      EXPECT_EQ(pixel.force.value[0], 2);
      EXPECT_GT(pixel.depth.value[0], 4.9);
    }
}

TEST_F(PictureTest, WhatIsMissingIsNamed) {
  const AreaLight lamp{floor_mesh(1), even(1)};
  const Material material = make_material(Diffuse{}, grey(1));
  const auto error = [&](const World& wrong) {
    return message([&] { render_surfaces(wrong.scene, camera(4), settings); });
  };
  EXPECT_EQ(error({rgb(), {surface_of(floor_mesh(1), 1)}, {material}, {}}), "surface 0 has no material");
  EXPECT_EQ(error({rgb(), {surface_of(floor_mesh(1))}, {material}, {lamp}}), "light 0 must have a surface of its mesh");
  EXPECT_EQ(error({rgb(), {surface_of(floor_mesh(1), 0, 1)}, {material}, {lamp}}),
            "surface 0 must be that of an area light");
  EXPECT_EQ(error({rgb(), {}, {make_material(Diffuse{}, BandValues::Ones(2))}, {}}),
            "material 0 must have a reflectance for each band of the light");
  settings.max_samples = 8;
  EXPECT_EQ(error({rgb(), {}, {}, {}}), "max_samples must be >= min_samples");
}

}  // namespace
}  // namespace tensorray
