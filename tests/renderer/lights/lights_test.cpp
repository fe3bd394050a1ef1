#include "renderer/lights/lights.h"

#include <array>
#include <cstdint>
#include <stdexcept>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "renderer/lights/beam.h"
#include "renderer/sampling/random.h"
#include "renderer/sampling/sampling.h"
#include "tests/renderer/shapes.h"
#include "tests/renderer/statistics.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

const AlignedBox3d unit_scene(Vector3d(-1, -1, -1), Vector3d(1, 1, 1));

/// A light of one band, 2 by 1.2, above the origin and tilted; it emits downwards.
AreaLight lamp(float radiance) {
  const Vector3d right(0.8, 0, -0.6), up(0, -1, 0);
  return {rectangle_mesh({0.3, -0.2, 1.5}, right, up, {2, 1.2}), {radiance}};
}

/// The irradiance of a surface without occluders, estimated as a renderer would do it.
Mean irradiance(const LightSampler& lights, const Vector3d& point, const Vector3d& normal, std::size_t band = 0,
                int samples = 20000) {
  Mean mean;
  LightSample sample;
  for (int i = 0; i < samples; ++i) {
    const Vector2d u(random_uniform(1, i, 1), random_uniform(1, i, 2));
    const bool found = lights.sample(point, u, sample);
    mean.add(found ? sample.radiance[band] * std::max(0.0, sample.direction.dot(normal)) / sample.pdf : 0);
  }
  return mean;
}

/// A picture with a bright spot on a dim background.
EnvironmentLight sky(int bands) {
  EnvironmentLight light;
  light.picture = Image(16, 8, {"Y"});
  for (int i = 0; i < 16 * 8; ++i) light.picture.pixels[i] = 0.2f + 0.1f * static_cast<float>(i % 7);
  *light.picture.pixel(3, 2) = 50;
  light.channel_spectra = Eigen::MatrixXf::Ones(bands, 1);
  return light;
}

TEST(AreaLight, IrradianceIsThatOfLambertsFormula) {
  const AreaLight light = lamp(3);
  const LightSampler lights({light}, {1}, unit_scene);
  for (const Vector3d& normal : {Vector3d(0, 0, 1), Vector3d(0.2, -0.1, 1).normalized()})
    for (const Vector3d& point : {Vector3d(0, 0, 0), Vector3d(0.4, -0.7, -1), Vector3d(-0.5, 0.5, 0.2)}) {
      const double exact = 3 * polygon_irradiance(light.mesh.vertices, point, normal);
      const Mean mean = irradiance(lights, point, normal);
      EXPECT_NEAR(mean.mean(), exact, 4 * mean.error());
      EXPECT_LT(mean.error(), 0.01 * exact);
    }
}

TEST(AreaLight, ShinesFromItsFrontOnly) {
  const Vector3d above(0.3, -0.2, 3), down(0, 0, -1), normal(-0.6, 0, -0.8);
  const LightSampler lights({lamp(3)}, {1}, unit_scene);
  EXPECT_EQ(irradiance(lights, above, down).mean(), 0);
  EXPECT_EQ(lights.area_pdf(0, above, {0.3, -0.2, 1.5}, normal), 0);
  EXPECT_EQ(lights.emitted(0, normal, down), nullptr);
  ASSERT_NE(lights.emitted(0, normal, -down), nullptr);
  EXPECT_EQ(*lights.emitted(0, normal, -down), std::vector<float>{3});
}

/// Lamps of many triangles are searched; each that a ray meets counts, not only the nearest.
TEST(AreaLight, DensityOfADirectionDoesNotDependOnTheNumberOfTriangles) {
  const auto square = [](double x, double y, double height, double size) {
    return rectangle_mesh({x, y, height}, {1, 0, 0}, {0, -1, 0}, {size, size});
  };
  const AreaLight near{square(0, 0, 1, 1), {1}}, far{square(0, 0, 2, 1), {1}};
  AreaLight fine{{}, {1}};  // Both together, each of 10 × 10 squares.
  for (int i = 0; i < 200; ++i) {
    const TriangleMesh part = square(0.1 * (i % 10) - 0.45, 0.1 * (i / 10 % 10) - 0.45, 1 + i / 100, 0.1);
    const auto first = static_cast<std::uint32_t>(fine.mesh.vertices.size());
    fine.mesh.vertices.insert(fine.mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& [a, b, c] : part.triangles) fine.mesh.triangles.push_back({first + a, first + b, first + c});
  }
  const LightSampler many({fine}, {1}, unit_scene), few({near, far}, {1}, unit_scene);
  int both = 0, one = 0;
  for (int i = 0; i < 10000; ++i) {
    const Vector3d point(random_uniform(7, i, 1) - 0.5, random_uniform(7, i, 2) - 0.5, i % 50 == 0 ? 100 * -i : 0.3);
    const Vector3d at(1.6 * random_uniform(7, i, 3) - 0.8, 1.6 * random_uniform(7, i, 4) - 0.8, 1);
    const Vector3d direction = (at - point).normalized();
    const double expected = few.direction_pdf(point, direction);
    EXPECT_NEAR(many.direction_pdf(point, direction), expected, 1e-6 * expected);
    const Vector3d there = point + (2 - point.z()) / direction.z() * direction;  // In the plane of the far one.
    (there.head<2>().lpNorm<Eigen::Infinity>() < 0.5 ? both : one) += expected > 0 ? 1 : 0;
  }
  EXPECT_GT(both, 500);
  EXPECT_GT(one, 100);
}

TEST(DirectionalLight, ADiskGivesItsIrradiance) {
  const Vector3d to_light(0, -0.6, 0.8);
  for (const double angle : {1e-6, 0.00465, 0.3, pi / 2}) {
    const LightSampler lights({DirectionalLight{-to_light, {5}, angle}}, {1}, unit_scene);
    const Mean facing = irradiance(lights, Vector3d::Zero(), to_light);
    EXPECT_NEAR(facing.mean(), 5, 4 * facing.error() + 1e-5) << angle;
    if (angle > 0.5) continue;
    // A uniform disk that is completely above the horizon has the same effect as a point light at its centre.
    const Mean tilted = irradiance(lights, Vector3d::Zero(), {0, 0, 1});
    EXPECT_NEAR(tilted.mean(), 5 * 0.8, 4 * tilted.error() + 1e-5) << angle;
    LightSample sample;
    ASSERT_TRUE(lights.sample(Vector3d::Zero(), {0.99, 0.3}, sample));
    EXPECT_FALSE(sample.is_delta);
    EXPECT_NEAR(sample.pdf * cone_solid_angle(angle), 1, 1e-12);
    EXPECT_EQ(lights.background_pdf(to_light), 1 / cone_solid_angle(angle));
  }
}

TEST(LightSampler, IrradianceOfAllLightsIsTheSum) {
  const Vector3d point(0.1, 0.2, -0.3), normal = Vector3d(0.1, 0, 1).normalized();
  const AreaLight area = lamp(3);
  const DirectionalLight parallel{{0, 0.6, -0.8}, {0.7f}, 0}, sun{{0.6, 0, -0.8}, {1.5f}, 0.05};
  const LightSampler lights({area, parallel, sun, ConstantLight{{0.25f}}, sky(1)}, {1}, unit_scene);

  EnvironmentMap map(sky(1), {1});
  constexpr int rows = 1000;
  double from_sky = 0, background_density = 0;
  std::vector<float> radiance{0};
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < 2 * rows; ++x) {
      const Vector3d d = square_to_sphere({(y + 0.5) / rows, (x + 0.5) / (2 * rows)});
      radiance[0] = 0;
      map.add_radiance(d, radiance);
      from_sky += radiance[0] * std::max(0.0, d.dot(normal)) * 2 * pi / rows / rows;
      background_density += lights.background_pdf(d) * 2 * pi / rows / rows;
    }
  const double exact = 3 * polygon_irradiance(area.mesh.vertices, point, normal) +
                       0.7 * -parallel.direction.dot(normal) + 1.5 * -sun.direction.dot(normal) + 0.25 * pi + from_sky;
  const Mean mean = irradiance(lights, point, normal, 0, 100000);
  EXPECT_NEAR(mean.mean(), exact, 4 * mean.error() + 1e-4 * exact);
  EXPECT_LT(mean.error(), 0.01 * exact);

  const double chosen = lights.choice_probability(2) + lights.choice_probability(3) + lights.choice_probability(4);
  EXPECT_NEAR(background_density, chosen, 0.01 * chosen);
  EXPECT_NEAR(chosen + lights.choice_probability(0) + lights.choice_probability(1), 1, 1e-14);
}

TEST(LightSampler, SampledBackgroundIsWhatARayWouldSee) {
  const LightSampler lights({DirectionalLight{{0.6, 0, -0.8}, {1.5f}, 0.05}, ConstantLight{{0.25f}}, sky(1)}, {1},
                            unit_scene);
  LightSample sample;
  std::vector<float> radiance;
  for (int i = 0; i < 1000; ++i) {
    const Vector2d u(random_uniform(3, i, 1), random_uniform(3, i, 2));
    ASSERT_TRUE(lights.sample(Vector3d::Zero(), u, sample));
    lights.background(sample.direction, radiance);
    EXPECT_EQ(radiance, sample.radiance);
    EXPECT_EQ(lights.background_pdf(sample.direction), sample.pdf);
    EXPECT_TRUE(std::isinf(sample.distance));
  }
}

TEST(LightSampler, NoLightIsDark) {
  const LightSampler lights({}, {1, 1}, {});
  LightSample sample;
  EXPECT_FALSE(lights.sample(Vector3d::Zero(), {0.5, 0.5}, sample));
  EXPECT_EQ(lights.background_pdf({0, 0, 1}), 0);
  std::vector<float> radiance;
  lights.background({0, 0, 1}, radiance);
  EXPECT_EQ(radiance, (std::vector<float>{0, 0}));
}

TEST(LightSampler, NamesTheLightThatIsWrong) {
  const auto error = [](const Light& light) {
    return message([&] { LightSampler({ConstantLight{{1, 1}}, light}, {1, 1}, unit_scene); });
  };
  EXPECT_EQ(error(ConstantLight{{1}}), "light 1: radiance must have a finite value >= 0 for each of the 2 bands");
  EXPECT_THROW(LightSampler({ConstantLight{{1}}}, {0}, unit_scene), std::invalid_argument);
  for (const auto& [light, what] : std::vector<std::pair<Light, std::string>>{
           {ConstantLight{{1, NAN}}, "radiance"},
           {AreaLight{{}, {1, 1}}, "triangles"},
           {AreaLight{{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}, {1, 1}}, "area"},
           {AreaLight{lamp(1).mesh, {1, -1}}, "radiance"},
           {DirectionalLight{{0, 0, 0}, {1, 1}, 0}, "direction"},
           {DirectionalLight{{0, 0, 1}, {1}, 0}, "irradiance"},
           {DirectionalLight{{0, 0, 1}, {1, 1}, 2}, "angle"},
           {sky(1), "bands"}})
    EXPECT_THAT(error(light), AllOf(StartsWith("light 1: "), HasSubstr(what)));
}

const std::vector<Vector3d> cube_corners = corners_of(unit_scene);

Beam downward() { return silhouette_beam(cube_corners, {0, 0, -1}, Vector3d::UnitY()); }

TEST(Beam, SilhouetteOfACube) {
  EXPECT_NEAR(area(downward().aperture), 4, 1e-12);
  // Along a diagonal it is a regular hexagon. Its area is 2 √3 times half the area of a face.
  const Beam hexagon = silhouette_beam(cube_corners, {1, 1, 1}, Vector3d::UnitZ());
  EXPECT_EQ(hexagon.aperture.size(), 6u);
  EXPECT_NEAR(area(hexagon.aperture), 4 * std::sqrt(3.0), 1e-12);
  for (const Vector3d& corner : cube_corners) EXPECT_GT((corner - hexagon.center).dot(hexagon.direction), 0);
  EXPECT_NEAR(hexagon.direction.norm(), 1, 1e-15);
  EXPECT_LT((hexagon.right.cross(hexagon.up) + hexagon.direction).norm(), 1e-14);
}

TEST(Beam, PositionsFillTheAperture) {
  const Beam beam = silhouette_beam(cube_corners, {1, 2, -3}, Vector3d::UnitZ());
  for (const BeamPattern pattern :
       {BeamPattern::grid, BeamPattern::stratified, BeamPattern::sobol, BeamPattern::random}) {
    SCOPED_TRACE(static_cast<int>(pattern));
    const BeamSampler sampler(beam, pattern, 20000, 7);
    double inside = 0;
    Emission emission;
    Vector3d sum = Vector3d::Zero();
    for (std::uint64_t i = 0; i < sampler.candidates(); ++i) {
      if (!sampler.sample(i, emission)) continue;
      ++inside;
      sum += emission.origin;
      EXPECT_NEAR((emission.origin - beam.center).dot(beam.direction), 0, 1e-12);
      EXPECT_GE(emission.stratum, 0);
      EXPECT_LT(emission.stratum, 1);
    }
    // The count of random positions has the standard deviation sqrt(count); allow 5 of them. Other patterns deviate far
    // less.
    EXPECT_NEAR(inside, 20000, 5 * std::sqrt(20000.0));
    EXPECT_NEAR(inside * sampler.area_per_candidate(), area(beam.aperture), 0.04 * area(beam.aperture));
    EXPECT_LT((sum / inside - beam.center).norm(), 0.05);  // The silhouette is symmetric.
  }
}

TEST(Beam, GridPositionsAreCellCentres) {
  const BeamSampler sampler(downward(), BeamPattern::grid, 16, 0);
  ASSERT_EQ(sampler.candidates(), 16u);
  Emission emission;
  ASSERT_TRUE(sampler.sample(5, emission));
  EXPECT_LT((emission.origin.head<2>() - Vector2d(-0.25, -0.25)).norm(), 1e-12);
  EXPECT_EQ(emission.across, Vector2d(0.375, 0.375));
}

TEST(Beam, StrataSpreadOverThePositions) {
  // In each part of the beam, an eighth of the positions of a lattice has its stratum in each of 8 ranges.
  for (const BeamPattern pattern : {BeamPattern::stratified, BeamPattern::sobol}) {
    const BeamSampler sampler(downward(), pattern, 4096, 3);
    std::array<std::array<int, 8>, 16> counts{};
    Emission emission;
    for (std::uint64_t i = 0; i < sampler.candidates(); ++i) {
      ASSERT_TRUE(sampler.sample(i, emission));
      const int x = static_cast<int>((emission.origin.x() + 1) * 2),
                y = static_cast<int>((emission.origin.y() + 1) * 2);
      ++counts[4 * y + x][static_cast<int>(emission.stratum * 8)];
    }
    for (const auto& part : counts)
      // Independent samples would give a standard deviation of 5.3.
      for (const int count : part) EXPECT_NEAR(count, 32, 8);
  }
}

}  // namespace
}  // namespace tensorray
