// Compares rays in packets, in single precision, with the same rays one by one in double precision.

#include "integrators/tracing/packet_tracer.h"

#include <limits>

#include <gtest/gtest.h>

#include "tests/integrators/packet_support.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Affine3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double huge = std::numeric_limits<double>::infinity();

using Packets = EveryInstructionSet;
INSTANTIATE_TEST_SUITE_P(All, Packets, test::instruction_sets(), instruction_set_name);

Scene random_scene(const Lattice& lattice, double step, double kick, int bundles) {
  TensorField field(lattice_grid(odd_box(), lattice, smooth_tensor(1)));
  RayBatch rays = random_rays(field, bundles, wavelengths(kick), 2);
  Scene scene = make_scene(lattice.name + ", step " + std::to_string(step) + ", kick " + std::to_string(kick),
                           std::move(field), {}, step, std::move(rays));
  scene.settings.max_steps = 500;
  return scene;
}

TEST_P(Packets, KeepToAThousandthOfAVoxelAfter500Steps) {
  for (const Lattice& lattice : tested_lattices()) {
    TensorField field(lattice_grid(index_box({-7, 3, -100}, {60, 62, 261}), lattice, smooth_tensor(3)));
    Numbers numbers(4);
    RayBatch rays;
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector2d across = numbers.two_between(-0.01, 0.01);
      add_bundle(rays, field, {numbers.between(18, 28), numbers.between(28, 38), -110}, {across.x(), across.y(), 1},
                 wavelengths(0.002));
    }
    const Scene scene = make_scene(lattice.name + ", long", std::move(field), {}, 0, std::move(rays));
    expect_reference(scene);
    for (const std::uint32_t steps : traced(scene, scene.rays).steps) EXPECT_GT(steps, 500u);
  }
}

TEST_P(Packets, FollowWeakAndMediumFieldsOnAnyLattice) {
  for (const Lattice& lattice : tested_lattices())
    for (const double step : {0.0, 0.25, 1.0, 2.0})
      for (const double kick : {1e-4, 0.01, 0.1}) expect_reference(random_scene(lattice, step, kick, 40), 0.1);
}

TEST_P(Packets, FollowStrongFieldsOnAnyLattice) {
  for (const Lattice& lattice : tested_lattices()) {
    for (const double step : {0.0, 0.25, 1.0, 2.0}) {
      // s h ‖T‖ up to 1; then up to 50, where light goes along the major eigenvectors.
      expect_reference(random_scene(lattice, step, 1 / std::max(step, 0.5), 40), 0.2);
      // There each step has an error of 50 roundings, so that few steps are compared.
      Scene scene = random_scene(lattice, step, 50 / std::max(step, 0.5), 40);
      scene.settings.max_steps = 20;
      expect_reference(scene, 0.5);
    }
  }
}

TEST_P(Packets, OnlyTheProductOfScaleFlexibilityAndTensorCounts) {
  constexpr double factor = 8;  // A power of two, so that rounding does not change.
  const TensorFunction smooth = smooth_tensor(1);
  const TensorFunction strong = [&](const Vector3d& p) { return Matrix3d(factor * smooth(p)); };
  for (const Lattice& lattice : tested_lattices())
    for (const double step : {0.0, 0.5}) {
      const Scene plain = random_scene(lattice, step, 1, 20);
      Scene scaled = random_scene(lattice, step, 1 / factor, 20);
      scaled.settings.scale = factor;
      const RayBatch expected = traced(plain, plain.rays), found = traced(scaled, scaled.rays);
      Scene other = make_scene("", TensorField(lattice_grid(odd_box(), lattice, strong)), {}, step, scaled.rays);
      other.settings.max_steps = plain.settings.max_steps;
      const RayBatch of_strong = traced(other, other.rays);
      EXPECT_NE(traced(plain, scaled.rays).position, found.position);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_TRUE(identical(found, i, expected, i)) << lattice.name << " " << step << ", ray " << i;
        EXPECT_TRUE(identical(of_strong, i, expected, i)) << lattice.name << " " << step << ", ray " << i;
      }
      scaled.settings.scale = -2.9;
      expect_reference(scaled, 0.2);
    }
}

TEST_P(Packets, TakeTheSameFewStepsInFieldsHoweverStrong) {
  // So few steps that errors do not grow.
  for (const double kick : {1.0, 20.0, 50.0}) {
    for (const double step : {0.0, 1.0}) {
      Scene scene = random_scene(lattices()[2], step, kick, 60);
      scene.settings.max_steps = 4;
      expect_reference(scene, 0.3);
    }
  }
}

TEST_P(Packets, CrossSparseFields) {
  for (const Lattice& lattice : tested_lattices())
    for (const double step : {0.0, 1.0})
      for (const double fraction : {0.5, 0.9}) {
        const TensorGrid grid = lattice_grid(index_box({-16, 8, -32}, {64, 56, 64}), lattice, smooth_tensor(5));
        TensorField field(without_blocks(grid, fraction, 6));
        RayBatch rays = random_rays(field, 40, wavelengths(0.1), 7);
        expect_reference(make_scene(lattice.name + ", sparse", std::move(field), {}, step, std::move(rays)), 0.1);
      }
}

TEST_P(Packets, CrossFieldsOfFewVoxels) {
  const Vector3i shapes[] = {{1, 30, 20}, {30, 1, 1}, {1, 1, 1}, {2, 3, 2}, {9, 8, 1}, {10, 9, 17}};
  for (const Lattice& lattice : tested_lattices())
    for (const Vector3i& voxels : shapes) {
      TensorField field(lattice_grid(index_box({7, -1, -9}, voxels), lattice, smooth_tensor(8)));
      RayBatch rays = random_rays(field, 40, wavelengths(0.3), 9);
      expect_reference(make_scene(lattice.name + ", few voxels", std::move(field), {}, 0, std::move(rays)), 0.1);
    }
}

TEST_P(Packets, PassASingularCorner) {
  const Generator load = PointLoad();
  TensorField field(generate(load, default_grid(load, 48)));
  RayBatch rays = rays_under_load(field, 200, 10);
  Surfaces surfaces;
  surfaces.plate = plate_across({0, 0, -1}, 3);
  expect_reference(make_scene("point load", std::move(field), std::move(surfaces), 0, std::move(rays)), 0.1);
}

/// A scene with surfaces within the field.
Scene scene_with(const std::string& name, const Lattice& lattice, const Surfaces& surfaces, double step) {
  TensorField field(lattice_grid(odd_box(), lattice, smooth_tensor(11)));
  RayBatch rays = random_rays(field, 60, wavelengths(0.05), 12);
  return make_scene(lattice.name + ", " + name, std::move(field), surfaces, step, std::move(rays));
}

Vector3d middle_of_field(const Lattice& lattice) { return lattice.to_world * odd_box().cast<double>().center(); }

/// A box about the middle of the field, edges in voxels.
TriangleMesh box_within(const Lattice& lattice, const Vector3d& edges) {
  const Vector3d middle = odd_box().cast<double>().center();
  Affine3d turned = lattice.to_world * Eigen::Translation3d(middle);
  turned.linear() = turned.linear() * Eigen::AngleAxisd(0.6, Vector3d(1, 1, -2).normalized()).toRotationMatrix();
  return box_mesh({Vector3d(-edges / 2), Vector3d(edges / 2)}, turned);
}

TEST_P(Packets, EndOnPlatesAndObstaclesWithinTheField) {
  for (const Lattice& lattice : tested_lattices())
    for (const double step : {0.0, 2.0}) {
      Surfaces within, oblique, obstacle, behind;
      within.plate = plate_across({0, 0, -1}, 0);
      within.plate->center = middle_of_field(lattice);
      within.plate->size = {4, 4};
      oblique.plate = plate_across({0.5, -0.3, -1}, 0);
      oblique.plate->center = middle_of_field(lattice) + Vector3d(0.11, 0.07, -0.23);
      oblique.plate->size = {4, 4};
      obstacle.obstacles.push_back(box_within(lattice, {9, 14, 5}));
      obstacle.plate = plate_across({0, 0, -1}, 0);
      obstacle.plate->center = middle_of_field(lattice) - Vector3d(0, 0, 5);
      behind.plate = obstacle.plate;
      expect_reference(scene_with("plate within", lattice, within, step), 0.1);
      expect_reference(scene_with("oblique plate", lattice, oblique, step), 0.1);
      expect_reference(scene_with("obstacle", lattice, obstacle, step), 0.1);
      expect_reference(scene_with("plate behind", lattice, behind, step), 0.1);
    }
}

TEST_P(Packets, EnterAndLeaveACut) {
  for (const Lattice& lattice : tested_lattices())
    for (const double step : {0.0, 2.0}) {
      Surfaces cut;
      cut.cut = box_within(lattice, {17, 15, 20});
      expect_reference(scene_with("cut", lattice, cut, step), 0.1);
      cut.plate = plate_across({0.5, -0.3, -1}, 0);
      cut.plate->center = middle_of_field(lattice);
      cut.plate->size = {4, 4};
      expect_reference(scene_with("cut with a plate", lattice, cut, step), 0.1);
    }
}

TEST_P(Packets, EndAtTheGreatestLength) {
  for (const Lattice& lattice : tested_lattices())
    for (const double length : {0.012, 1.013, 3.017, 7.003}) {  // World units: in the field, and before and behind it.
      Scene scene = scene_with("to length " + std::to_string(length), lattice, {}, 0);
      scene.settings.max_length = length;
      expect_reference(scene, 0.1);
    }
}

TEST_P(Packets, EndAtTheGreatestNumberOfSteps) {
  for (const Lattice& lattice : tested_lattices())
    for (const int steps : {1, 2, 17, 50}) {
      Surfaces cut;
      cut.cut = box_within(lattice, {17, 15, 20});
      for (const Surfaces& surfaces : {Surfaces(), cut}) {
        Scene scene = scene_with(std::to_string(steps) + " steps", lattice, surfaces, 0.25);
        scene.settings.max_steps = steps;
        expect_reference(scene, 0.1);
      }
    }
}

TEST_P(Packets, LeaveAndTurnBackAtFacesAsTheReferenceDoes) {
  // Light along the faces of a strong field: the middle of a step may be outside while its end is not.
  for (const Lattice& lattice : tested_lattices()) {
    TensorField field(lattice_grid(index_box({0, 0, 0}, {17, 17, 17}), lattice, [](const Vector3d& p) {
      return Matrix3d(smooth_tensor(13)(p) + general_tensor());
    }));
    Numbers numbers(14);
    RayBatch rays;
    for (int i = 0; i < 3000; ++i) {
      Vector3d from = numbers.in(field.index_bounds()), along = numbers.direction();
      const auto axis = static_cast<Eigen::Index>(numbers.below(3));
      const bool far = numbers.next() < 0.5;
      from[axis] = far ? 16 - 0.1 * numbers.next() : 0.1 * numbers.next();
      along[axis] = (far ? 0.3 : -0.3) * numbers.next();
      add_bundle(rays, field, from, along, {numbers.between(-0.5, 0.5)});
    }
    expect_reference(make_scene(lattice.name + ", along faces", std::move(field), {}, 0, std::move(rays)), 0.1);
  }
}

/// Expects the same ends of rays as the reference through unusual fields, and finite positions.
void expect_same_ends(const std::string& name, const TensorFunction& tensor, const std::vector<double>& flexibilities) {
  SCOPED_TRACE(name);
  TensorField field(lattice_grid(index_box({-3, 0, 2}, {20, 17, 19}), lattices()[0], tensor));
  Surfaces surfaces;
  surfaces.plate = plate_across({0, 0, -1}, 3);
  RayBatch rays = random_rays(field, 40, flexibilities, 15);
  Scene scene = make_scene(name, std::move(field), std::move(surfaces), 0, std::move(rays));
  scene.settings.max_steps = 300;
  const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
  const RayBatch moved = traced_by_reference(scene, turned_a_little(scene));
  std::size_t compared = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_TRUE(fast.position[i].allFinite() && fast.direction[i].allFinite()) << i;
    EXPECT_TRUE(std::isfinite(fast.length[i]) && fast.length[i] >= 0) << i;
    EXPECT_EQ(fast.end[i] == RayEnd::degenerate, exact.end[i] == RayEnd::degenerate) << "ray " << i;
    // Where light turns by more in a step, the turn depends on rounding.
    const bool follows = std::abs(scene.rays.flexibility[i]) * scene.field.greatest_norm() * mean_edge < 10;
    if (moved.end[i] != exact.end[i] || !follows) continue;
    ++compared;
    EXPECT_EQ(fast.end[i], exact.end[i]) << "ray " << i << ", s " << scene.rays.flexibility[i];
  }
  EXPECT_GT(compared, 40u / 2);
}

TEST_P(Packets, EndAsTheReferenceDoesInOddFields) {
  const TensorFunction smooth = smooth_tensor(16);
  const auto times = [&](double factor) { return [=](const Vector3d& p) { return Matrix3d(factor * smooth(p)); }; };
  const auto zero = [](const Vector3d&) { return Matrix3d::Zero().eval(); };
  const auto partly_zero = [&](const Vector3d& p) { return Matrix3d(p.x() < 7 ? Matrix3d::Zero().eval() : smooth(p)); };
  const double nan = std::nan("");
  const std::vector<double> ordinary = {0.1, -0.1, 0};
  expect_same_ends("denormal", times(1e-41), ordinary);
  expect_same_ends("zeros", zero, {0.1, 1e30, 1e300, -1e300, nan, huge});
  expect_same_ends("some zeros", partly_zero, {0.1, 1e4, nan});
  expect_same_ends("strong", times(1e15), {0.1, -0.1, 0, 1e-15});
  expect_same_ends("ordinary", smooth, {0, -0.3, 1e30, -1e30, 1e38, 1e200, 1e308, nan, huge, -huge});
}

TEST_P(Packets, BendHoweverStrongTheFieldIs) {
  // A strong constant field turns light to the direction that its exponential stretches most: the direction of a shear,
  // or an eigenvector.
  Matrix3d shear = Matrix3d::Zero();
  shear(0, 1) = 1;
  for (const Matrix3d& tensor : {shear, general_tensor(), Matrix3d(Vector3d(1, -2, 0.5).asDiagonal())}) {
    TensorField field(
        lattice_grid(index_box({0, 0, 0}, {17, 17, 17}), lattices()[0], [&](const Vector3d&) { return tensor; }));
    Numbers numbers(17);
    RayBatch rays;
    for (int i = 0; i < 40; ++i) {
      // The first six are along axes and in the planes between axes. Some of these shrink, and there only rounding
      // makes light leave the axis or plane.
      const Vector3d towards = i < 3   ? Vector3d::Unit(i)
                               : i < 6 ? Vector3d(Vector3d::Ones() - Vector3d::Unit(i - 3))
                                       : numbers.direction();
      add_bundle(rays, field, numbers.in(field.index_bounds()), towards.normalized(),
                 {3, 30, 1e4, 1e9, 1e18, 1e25, 1e35});
    }
    Scene scene = make_scene("strong constant field", std::move(field), {}, 1, std::move(rays));
    scene.settings.max_steps = 2;
    const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_EQ(fast.end[i], exact.end[i]) << "ray " << i << ", s " << scene.rays.flexibility[i];
      // Where eigenvalues are complex, the turn of light is too large for the precision of s.
      if (tensor == general_tensor() && scene.rays.flexibility[i] > 1e4) continue;
      EXPECT_LT((fast.direction[i] - exact.direction[i]).norm(), 1e-3)
          << "ray " << i << ", s " << scene.rays.flexibility[i];
    }
  }
}

TEST_P(Packets, ZeroFlexibilityLeavesLightStraight) {
  Scene scene = random_scene(lattices()[2], 0, 0.1, 40);
  std::fill(scene.rays.flexibility.begin(), scene.rays.flexibility.end(), 0.0);
  const RayBatch ends = traced(scene, scene.rays);
  for (std::size_t i = 0; i < ends.size(); ++i)
    EXPECT_LT((ends.direction[i] - scene.rays.direction[i]).norm(), 1e-6);  // A few units in the last place.
}

}  // namespace
}  // namespace tensorray
