// Compares each method in packets, in single precision, with the same method in double precision.

#include <gtest/gtest.h>

#include "integrators/tracing/packet_tracer.h"
#include "integrators/tracing/trace.h"
#include "tests/integrators/packet_support.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

/// A method, and the fields that it is tried in.
struct Variant {
  BendingMethod method;
  Interpolant interpolant;
};

constexpr Interpolant linear{Interpolation::linear, Border::fade}, cubic{Interpolation::cubic, Border::fade};
constexpr Variant variants[] = {
    {BendingMethod::euler, linear},    {BendingMethod::splitting4, linear}, {BendingMethod::rk4, linear},
    {BendingMethod::bs23, linear},     {BendingMethod::dopri5, linear},     {BendingMethod::splitting4, cubic},
    {BendingMethod::splitting, cubic}, {BendingMethod::euler, cubic},       {BendingMethod::rk4, cubic},
    {BendingMethod::bs23, cubic},      {BendingMethod::dopri5, cubic}};

std::string name_of(const Variant& variant) {
  const char* const names[] = {"automatic", "euler", "splitting", "splitting4", "rk4", "bs23", "dopri5"};
  return names[static_cast<int>(variant.method)] + std::string(variant.interpolant == cubic ? ", cubic" : "");
}

using PacketMethods = EveryInstructionSet;
INSTANTIATE_TEST_SUITE_P(All, PacketMethods, test::instruction_sets(), instruction_set_name);

Scene scene_of(const Variant& variant, const std::string& name, TensorField field, const Surfaces& surfaces,
               double step, RayBatch rays) {
  Scene scene = make_scene(name_of(variant) + ", " + name, std::move(field), surfaces, step, std::move(rays));
  scene.settings.method = variant.method;
  // The smallest tolerance that packets are made for. The errors of a few hundred steps stay below the differences that
  // tests accept.
  scene.settings.tolerance = 1e-5;
  return scene;
}

/// Where tensors have kinks, the errors of an adaptive method depend on where exactly its steps end, and that depends
/// on rounding. The errors of packets are then as large as those of the reference, but not equal to them. Both are
/// compared with the reference at a hundredth of the tolerance.
void expect_as_exact_as_reference(const Scene& scene) {
  SCOPED_TRACE(scene.name);
  const RayBatch fast = traced(scene, scene.rays), reference = traced_by_reference(scene, scene.rays);
  BendingSettings settings = scene.settings;
  settings.tolerance /= 100;
  RayBatch truth = scene.rays;
  trace_reference(scene.field, scene.geometry, settings, truth);
  std::vector<double> errors, usual_errors;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    errors.push_back(distance_in_voxels(fast.position[i], truth.position[i]));
    usual_errors.push_back(distance_in_voxels(reference.position[i], truth.position[i]));
  }
  std::sort(errors.begin(), errors.end());
  std::sort(usual_errors.begin(), usual_errors.end());
  for (const double part : {0.5, 0.75, 0.9}) {
    const auto i = static_cast<std::size_t>(part * static_cast<double>(errors.size()));
    EXPECT_LE(errors[i], 2 * usual_errors[i] + position_tolerance) << part;
    EXPECT_LE(usual_errors[i], 2 * errors[i] + position_tolerance) << part;
  }
}

void expect_like_reference(const Scene& scene) {
  if (is_adaptive(scene.settings)) return expect_as_exact_as_reference(scene);
  expect_reference(scene, 0.1);
}

/// Whether steps are so long that they do not see the kinks of linear fields.
bool has_kinks(const Variant& variant) {
  return variant.method == BendingMethod::splitting4 && variant.interpolant == linear;
}

Scene random_scene(const Variant& variant, const Lattice& lattice, double step, double kick, int bundles) {
  TensorField field(lattice_grid(odd_box(), lattice, smooth_tensor(41)), variant.interpolant);
  RayBatch rays = random_rays(field, bundles, wavelengths(kick), 42);
  const std::string name = lattice.name + ", step " + std::to_string(step) + ", kick " + std::to_string(kick);
  Scene scene = scene_of(variant, name, std::move(field), {}, step, std::move(rays));
  scene.settings.max_steps = 1000;
  return scene;
}

TEST_P(PacketMethods, KeepToAThousandthOfAVoxelOnLongWays) {
  for (const Lattice& lattice : tested_lattices()) {
    for (const Variant& variant : variants) {
      TensorField field(lattice_grid(index_box({-7, 3, -100}, {60, 62, 261}), lattice, smooth_tensor(3)),
                        variant.interpolant);
      Numbers numbers(4);
      RayBatch rays;
      for (int i = 0; i < 10; ++i) {
        const Eigen::Vector2d across = numbers.two_between(-0.01, 0.01);
        add_bundle(rays, field, {numbers.between(18, 28), numbers.between(28, 38), -110}, {across.x(), across.y(), 1},
                   wavelengths(0.002));
      }
      const Scene scene = scene_of(variant, lattice.name + ", long", std::move(field), {}, 0, std::move(rays));
      expect_like_reference(scene);
      for (const std::uint32_t steps : traced(scene, scene.rays).steps)
        EXPECT_GT(steps, variant.method == BendingMethod::splitting4 ? 30 : is_adaptive(scene.settings) ? 100 : 500);
    }
  }
}

TEST_P(PacketMethods, FollowFieldsOnAnyLattice) {
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants)
      for (const double step : {0.0, 0.25, 1.0})
        for (const double kick : {1e-4, 0.01, 0.1}) {
          const Scene scene = random_scene(variant, lattice, step, kick, 24);
          has_kinks(variant) ? expect_like_reference(scene) : expect_reference(scene, 0.1);
        }
}

TEST_P(PacketMethods, FollowStrongFields) {
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants)
      for (const double kick : {0.5, 2.0}) {
        Scene scene = random_scene(variant, lattice, 0, kick, 24);
        scene.settings.max_length = 1.013;  // World units: some 20 voxels.
        expect_like_reference(scene);
      }
}

TEST_P(PacketMethods, TakeTheSameFewStepsInStrongFields) {
  const auto expect_few_steps = [](Scene scene) {
    scene.settings.max_steps = 4;
    expect_reference(scene, 0.4);
  };
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants) {
      if (variant.method == BendingMethod::splitting || is_adaptive(variant.method, 1)) continue;
      if (variant.method == BendingMethod::splitting4) {
        expect_few_steps(random_scene(variant, lattice, 1, 5, 24));
        continue;
      }
      expect_few_steps(random_scene(variant, lattice, 0, 5, 24));
      expect_few_steps(random_scene(variant, lattice, 0.25, 5, 24));  // Long steps for the order of the method.
      expect_few_steps(random_scene(variant, lattice, 0, 1000, 24));  // Steps too short for single precision.
    }
}

TEST_P(PacketMethods, CrossSparseFields) {
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants)
      for (const double fraction : {0.5, 0.9}) {
        const TensorGrid grid = lattice_grid(index_box({-16, 8, -32}, {64, 56, 64}), lattice, smooth_tensor(45));
        TensorField field(without_blocks(grid, fraction, 46), variant.interpolant);
        RayBatch rays = random_rays(field, 24, wavelengths(0.1), 47);
        expect_like_reference(scene_of(variant, lattice.name + ", sparse", std::move(field), {}, 0, std::move(rays)));
      }
}

TEST_P(PacketMethods, CrossFieldsOfFewVoxels) {
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants)
      for (const Vector3i& voxels : {Vector3i(1, 30, 20), Vector3i(30, 1, 1), Vector3i(2, 3, 2), Vector3i(10, 9, 17)}) {
        TensorField field(lattice_grid(index_box({7, -1, -9}, voxels), lattice, smooth_tensor(48)),
                          variant.interpolant);
        RayBatch rays = random_rays(field, 24, wavelengths(0.3), 49);
        expect_like_reference(
            scene_of(variant, lattice.name + ", few voxels", std::move(field), {}, 0, std::move(rays)));
      }
}

TEST_P(PacketMethods, PassASingularCorner) {
  const Generator load = PointLoad();
  for (const Variant& variant : variants) {
    TensorField field(generate(load, default_grid(load, 48)), variant.interpolant);
    RayBatch rays = rays_under_load(field, 100, 50);
    Surfaces surfaces;
    surfaces.plate = plate_across({0, 0, -1}, 3);
    expect_like_reference(scene_of(variant, "point load", std::move(field), surfaces, 0, std::move(rays)));
  }
}

/// A cut, an oblique plate and an obstacle within the field.
Surfaces surfaces_within(const Lattice& lattice, bool with_cut) {
  const Vector3d middle = lattice.to_world * odd_box().cast<double>().center();
  Eigen::Affine3d turned = lattice.to_world;
  turned.translation() = middle;
  turned.linear() = turned.linear() * Eigen::AngleAxisd(0.6, Vector3d(1, 1, -2).normalized()).toRotationMatrix();
  Surfaces surfaces;
  if (with_cut) surfaces.cut = box_mesh({Vector3d(-9, -8, -10), Vector3d(9, 8, 10)}, turned);
  surfaces.obstacles.push_back(box_mesh({Vector3d(-2, -3, 4), Vector3d(3, 2, 6)}, turned));
  surfaces.plate = plate_across({0.5, -0.3, -1}, 0);
  surfaces.plate->center = middle;
  surfaces.plate->size = {0.6, 0.6};
  return surfaces;
}

TEST_P(PacketMethods, EndOnSurfacesWithinTheField) {
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants)
      for (const bool with_cut : {false, true}) {
        TensorField field(lattice_grid(odd_box(), lattice, smooth_tensor(51)), variant.interpolant);
        RayBatch rays = random_rays(field, 40, wavelengths(0.05), 52);
        const Scene scene = scene_of(variant, lattice.name + (with_cut ? ", cut" : ", plate"), std::move(field),
                                     surfaces_within(lattice, with_cut), 0, std::move(rays));
        has_kinks(variant) ? expect_like_reference(scene) : expect_reference(scene, 0.1);
      }
}

TEST_P(PacketMethods, EndAtTheGreatestLengthAndNumberOfSteps) {
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : variants) {
      Scene scene = random_scene(variant, lattice, 0, 0.05, 40);
      scene.settings.max_length = 1.013;
      expect_reference(scene, 0.1);
      scene.settings.max_length = std::numeric_limits<double>::infinity();
      scene.settings.max_steps = 7;
      if (!is_adaptive(scene.settings)) expect_reference(scene, 0.1);
      const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
      for (std::size_t i = 0; i < exact.size(); ++i) {
        EXPECT_LE(fast.steps[i], 7u);
        EXPECT_TRUE(fast.end[i] != RayEnd::step_limit || fast.steps[i] == 7);
      }
      const auto limited = [](const RayBatch& rays) {
        return std::count(rays.end.begin(), rays.end.end(), RayEnd::step_limit);
      };
      EXPECT_GT(limited(fast), 0);
      EXPECT_NEAR(double(limited(fast)), double(limited(exact)), 0.1 * double(exact.size()));
    }
}

TEST_P(PacketMethods, EndAsTheReferenceDoesInOddFields) {
  const TensorFunction smooth = smooth_tensor(53);
  for (const Variant& variant : variants)
    for (const double factor : {1e-41, 1.0, 1e15, std::nan("")}) {
      TensorField field(lattice_grid(index_box({-3, 0, 2}, {20, 17, 19}), lattices()[0],
                                     [&](const Vector3d& p) {
                                       // A part of the field has no deviator, but a trace that reverses light in Eq. 3.
                                       return p.x() < 5 ? Matrix3d(-30 * factor * Matrix3d::Identity())
                                                        : Matrix3d(factor * smooth(p));
                                     }),
                        variant.interpolant);
      RayBatch rays = random_rays(field, 24, {0.1, -0.1, 0, 1e30, 1e300, std::nan("")}, 54);
      Scene scene = scene_of(variant, "factor " + std::to_string(factor), std::move(field), {}, 0, std::move(rays));
      scene.settings.max_steps = 300;
      SCOPED_TRACE(scene.name);
      const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
      const RayBatch moved = traced_by_reference(scene, turned_a_little(scene));
      std::size_t compared = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        EXPECT_TRUE(fast.position[i].allFinite() && fast.direction[i].allFinite()) << i;
        const bool follows = std::abs(scene.rays.flexibility[i]) * scene.field.greatest_norm() * mean_edge < 10;
        if (moved.end[i] != exact.end[i] || !follows) continue;
        ++compared;
        EXPECT_EQ(fast.end[i], exact.end[i]) << "ray " << i << ", s " << scene.rays.flexibility[i];
      }
      EXPECT_TRUE(!(factor <= 1) || compared > exact.size() / 4);
    }
}

TEST_P(PacketMethods, RaysDoNotDependOnTheirNeighbours) {
  for (const Variant& variant : variants) {
    const Lattice lattice = lattices()[2];
    const TensorGrid grid = lattice_grid(odd_box(), lattice, smooth_tensor(55));
    TensorField field(without_blocks(grid, 0.3, 56), variant.interpolant);
    RayBatch rays = random_rays(field, 16, {1e-4, 0.3, -30, 0, 0.02, 5, 1e5, -0.1, 1e300, 0.002, 0.6}, 57);
    Scene scene = scene_of(variant, "unlike", std::move(field), surfaces_within(lattice, true), 0, std::move(rays));
    scene.settings.max_steps = 200;
    SCOPED_TRACE(scene.name);
    const RayBatch all = traced(scene, scene.rays);
    RayBatch backwards;
    for (std::size_t i = all.size(); i-- > 0;) {
      const auto add = [&](RayBatch& to) {
        to.add(scene.rays.position[i], scene.rays.direction[i], scene.rays.flexibility[i]);
      };
      RayBatch alone;
      add(alone);
      add(backwards);
      EXPECT_TRUE(identical(traced(scene, alone), 0, all, i)) << "ray " << i;
    }
    backwards = traced(scene, backwards);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_TRUE(identical(backwards, all.size() - 1 - i, all, i)) << i;
  }
}

TEST_P(PacketMethods, RecordTheSameRays) {
  for (const Variant& variant : variants) {
    const Scene scene = random_scene(variant, lattices()[2], 0, 0.05, 16);
    RayBatch recorded = scene.rays;
    std::vector<RayRecord> records;
    trace(scene.field, scene.geometry, scene.settings, recorded, &records);
    const RayBatch alone = traced(scene, scene.rays);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      EXPECT_TRUE(identical(recorded, i, alone, i)) << name_of(variant) << ", ray " << i;
      // The first two and the last two points are on surfaces or outside the field.
      const PathPoints points = points_of(scene.field, records[i]);
      for (std::size_t k = 3; k + 3 < points.size(); ++k) {
        const double chord = (points[k].position - points[k - 1].position).norm();
        const double length = points[k].length - points[k - 1].length;
        EXPECT_GT(length, 0) << name_of(variant) << ", ray " << i << ": a step that is repeated is no point";
        EXPECT_LE(chord, length * (1 + 1e-4) + 1e-7);
      }
    }
  }
}

/// Λ is the same to single precision, and does not depend on neighbours; that it is wanted changes no ray.
TEST_P(PacketMethods, KnowTheChangeOfRadiance) {
  std::vector<Variant> all_variants(std::begin(variants), std::end(variants));
  all_variants.push_back({BendingMethod::splitting, linear});
  for (const Variant& variant : all_variants)
    for (const double kick : {1e-3, 0.05, 0.5}) {
      Scene scene = random_scene(variant, lattices()[variant.method == BendingMethod::rk4 ? 2 : 0], 0, kick, 40);
      SCOPED_TRACE(scene.name);
      const RayBatch plain = traced(scene, scene.rays);
      scene.rays.wants_log_radiance_scale = true;
      const RayBatch all = traced(scene, scene.rays), reference = traced_by_reference(scene, scene.rays);
      double greatest = 0;
      int compared = 0;
      for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_TRUE(identical(all, i, plain, i)) << "ray " << i;
        RayBatch alone;
        alone.wants_log_radiance_scale = true;
        alone.add(scene.rays.position[i], scene.rays.direction[i], scene.rays.flexibility[i]);
        EXPECT_EQ(traced(scene, alone).log_radiance_scale[0], all.log_radiance_scale[i]);
        if (!agree(all, reference, i)) continue;  // Other steps.
        ++compared;
        const double change = reference.log_radiance_scale[i];
        EXPECT_NEAR(all.log_radiance_scale[i], change, 1e-3 * (1 + std::abs(change))) << "ray " << i;
        greatest = std::max(greatest, std::abs(change));
      }
      EXPECT_GT(greatest, kick);
      EXPECT_GT(compared, static_cast<int>(all.size()) / 2);
    }
}

/// Adding c(P) I to T changes no ray and no Λ.
TEST_P(PacketMethods, IsotropicTensorsChangeNoRadiance) {
  const TensorFunction smooth = smooth_tensor(41);
  const auto changes = [&](double c) {
    TensorField field(lattice_grid(index_box({0, 0, 0}, {24, 24, 24}), lattices()[0], [&](const Vector3d& p) {
      return Matrix3d(0.1 * (smooth(p) + c * p.x() * Matrix3d::Identity()));
    }));
    RayBatch rays = random_rays(field, 16, {0.3, -1}, 42);
    rays.wants_log_radiance_scale = true;
    const Scene scene = make_scene("isotropic", std::move(field), {}, 0, std::move(rays));
    return traced(scene, scene.rays).log_radiance_scale;
  };
  const std::vector<double> without = changes(0), with = changes(1);
  for (std::size_t i = 0; i < with.size(); ++i) EXPECT_NEAR(with[i], without[i], 1e-3) << "ray " << i;
  EXPECT_GT(*std::max_element(without.begin(), without.end()), 0.1);
}

/// Rays with derivatives, along a parallel shift and along a shift with a turn.
RayBatch with_differentials(RayBatch rays) {
  for (const Vector3d& direction : rays.direction) {
    RayDifferential differential;
    const Vector3d across = upright(direction, Vector3d(1, 2, 3).normalized());
    differential.position.col(0) = across;
    differential.position.col(1) = direction.cross(across);
    differential.direction.col(1) = 0.3 * direction.cross(across);
    rays.differentials.push_back(differential);
  }
  return rays;
}

TEST_P(PacketMethods, CarryDifferentials) {
  std::vector<Variant> all_variants(std::begin(variants), std::end(variants));
  all_variants.push_back({BendingMethod::splitting, linear});
  // Derivatives jump where a ray crosses the face of a cell, except in a field that is linear in position.
  for (const Lattice& lattice : tested_lattices())
    for (const Variant& variant : all_variants) {
      const Vector3d middle = odd_box().cast<double>().center();
      TensorField field(
          lattice_grid(odd_box(), lattice,
                       [&](const Vector3d& p) {
                         return Matrix3d(0.02 * (1 + 0.03 * (p - middle).x() - 0.05 * (p - middle).y()) *
                                             general_tensor() +
                                         0.001 * (p - middle).z() * Matrix3d(Vector3d(1, -2, 0.5).asDiagonal()));
                       }),
          variant.interpolant);
      RayBatch rays = with_differentials(random_rays(field, 40, {0.3, -0.5, 1}, 58));
      const Scene scene = scene_of(variant, lattice.name + ", differentials", std::move(field),
                                   surfaces_within(lattice, false), 0, std::move(rays));
      SCOPED_TRACE(scene.name);
      const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
      RayBatch turned = turned_a_little(scene);
      turned.differentials = scene.rays.differentials;
      const RayBatch moved = traced_by_reference(scene, turned);
      std::size_t compared = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        const auto apart = [&](const RayBatch& a) {
          const RayDifferential &of = a.differentials[i], &right = exact.differentials[i];
          return std::max((of.position - right.position).norm() / right.position.norm(),
                          (of.direction - right.direction).norm() / (right.direction.norm() + right.position.norm()));
        };
        if (moved.end[i] != exact.end[i] || apart(moved) > 1e-4) continue;  // The light grazes a surface.
        ++compared;
        EXPECT_EQ(fast.end[i], exact.end[i]);
        EXPECT_LT(apart(fast), 1e-3) << "ray " << i << " after " << exact.steps[i] << " steps";
      }
      EXPECT_GT(compared, exact.size() * 8 / 10);
    }
}

TEST(PacketMethods, TightTolerancesAreForDoublePrecision) {
  Scene scene = random_scene({BendingMethod::dopri5, linear}, lattices()[0], 0, 0.05, 8);
  scene.settings.tolerance = 1e-7;
  const RayBatch ends = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
  for (std::size_t i = 0; i < exact.size(); ++i) EXPECT_TRUE(identical(ends, i, exact, i)) << i;
}

}  // namespace
}  // namespace tensorray
