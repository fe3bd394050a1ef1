// Compares rays in packets, in single precision, with the same rays one by one in double precision. Tests that what
// becomes of a ray does not depend on the others.

#include "tracing/kernels/packet_kernel.h"

#include <numeric>

#include "tests/tracing/packet_support.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

using PacketKernel = EveryInstructionSet;
INSTANTIATE_TEST_SUITE_P(All, PacketKernel, test::instruction_sets(), instruction_set_name);

Scene random_scene(const Lattice& lattice, double step, double kick, int bundles) {
  static const TensorGrid once = lattice_grid(odd_box(), lattices()[0], smooth_tensor(41));
  TensorField field = placed(once, lattice);
  RayBatch rays = random_rays(field, bundles, wavelengths(kick), 42);
  const std::string name = lattice.name + ", step " + std::to_string(step) + ", kick " + std::to_string(kick);
  return make_scene(name, std::move(field), {}, step, std::move(rays));
}

TEST_P(PacketKernel, KeepsToAThousandthOfAVoxelOnLongWays) {
  static const TensorGrid once = lattice_grid(index_box({-7, 3, -100}, {60, 62, 261}), lattices()[0], smooth_tensor(3));
  for (const Lattice& lattice : tested_lattices()) {
    TensorField field = placed(once, lattice);
    Numbers numbers(4);
    RayBatch rays;
    for (int i = 0; i < 10; ++i) {
      const Vector2d across = numbers.two_between(-0.01, 0.01);
      add_bundle(rays, field, {numbers.between(18, 28), numbers.between(28, 38), -110}, {across.x(), across.y(), 1},
                 wavelengths(0.002));
    }
    const Scene scene = make_scene(lattice.name + ", long", std::move(field), {}, 0, std::move(rays));
    expect_as_exact_as_reference(scene);
    for (const std::uint32_t steps : traced(scene, scene.rays).steps) EXPECT_GT(steps, 30u);
  }
}

TEST_P(PacketKernel, FollowsFieldsOnAnyLattice) {
  for (const Lattice& lattice : tested_lattices()) {
    for (const double step : {0.0, 0.25, 1.0})
      for (const double kick : {1e-4, 0.01, 0.1}) expect_reference(random_scene(lattice, step, kick, 24), 0.1);
    Scene scene = random_scene(lattice, 1, 0.01, 24);  // As the search for the automatic scale.
    scene.settings.method = BendingMethod::splitting;
    expect_reference(scene, 0.1);
  }
}

TEST_P(PacketKernel, FollowsStrongFields) {
  for (const Lattice& lattice : tested_lattices()) {
    for (const double kick : {0.5, 2.0}) {
      Scene scene = random_scene(lattice, 0, kick, 24);
      scene.settings.max_length = 1.013;  // World units: some 20 voxels.
      expect_as_exact_as_reference(scene);
    }
    for (const double kick : {1.0, 5.0}) {  // So few steps that errors do not grow.
      Scene scene = random_scene(lattice, 1, kick, 24);
      scene.settings.max_steps = 4;
      expect_reference(scene, 0.4);
    }
  }
}

TEST_P(PacketKernel, CrossesSparseFieldsAndFewVoxels) {
  for (const Lattice& lattice : tested_lattices()) {
    const auto expect = [&](TensorField field, double kick) {
      RayBatch rays = random_rays(field, 24, wavelengths(kick), 47);
      expect_as_exact_as_reference(make_scene(lattice.name, std::move(field), {}, 0, std::move(rays)));
    };
    const TensorGrid grid = lattice_grid(index_box({-16, 8, -32}, {64, 56, 64}), lattice, smooth_tensor(45));
    for (const double fraction : {0.5, 0.9}) expect(cubic_field(without_blocks(grid, fraction, 46)), 0.1);
    for (const Vector3i& voxels : {Vector3i(1, 30, 20), Vector3i(30, 1, 1), Vector3i(2, 3, 2), Vector3i(10, 9, 17)})
      expect(lattice_field(index_box({7, -1, -9}, voxels), lattice, smooth_tensor(48)), 0.3);
  }
}

/// Rays all over the loaded face of a point load; every tenth bundle is directly under the load.
TEST_P(PacketKernel, PassesASingularCorner) {
  const Generator load = PointLoad();
  TensorField field = cubic_field(generate(load, default_grid(load, 48)));
  Numbers numbers(50);
  RayBatch rays;
  for (int i = 0; i < 100; ++i) {
    const double reach = i % 10 ? 20 : 2;
    const Vector2d from = numbers.two_between(-reach, reach);
    add_bundle(rays, field, {23.5 + from.x(), 23.5 + from.y(), 60}, {0, 0, -1}, {0.1, 0.2, 0.3});
  }
  Surfaces surfaces;
  surfaces.plate = plate_across({0, 0, -1}, 3);
  expect_as_exact_as_reference(make_scene("point load", std::move(field), surfaces, 0, std::move(rays)));
}

/// Light along the faces of a strong field: samples may be outside while the ends of a step are not.
TEST_P(PacketKernel, LeavesAndTurnsBackAtFacesAsTheReferenceDoes) {
  for (const Lattice& lattice : tested_lattices()) {
    TensorField field = lattice_field(index_box({0, 0, 0}, {17, 17, 17}), lattice, [](const Vector3d& p) {
      return Matrix3d(smooth_tensor(13)(p) + general_tensor());
    });
    Numbers numbers(14);
    RayBatch rays;
    for (int i = 0; i < 1000; ++i) {
      Vector3d from = numbers.in(field.index_bounds()), along = numbers.direction();
      const auto axis = static_cast<Eigen::Index>(numbers.below(3));
      const bool far = numbers.next() < 0.5;
      from[axis] = far ? 16 - 0.1 * numbers.next() : 0.1 * numbers.next();
      along[axis] = (far ? 0.3 : -0.3) * numbers.next();
      add_bundle(rays, field, from, along, {numbers.between(-0.5, 0.5)});
    }
    expect_as_exact_as_reference(make_scene(lattice.name + ", along faces", std::move(field), {}, 0, std::move(rays)));
  }
}

/// A cut, an oblique plate and an obstacle within the field.
Surfaces surfaces_within(const Lattice& lattice, bool with_cut) {
  const Vector3d middle = lattice.to_world * odd_box().cast<double>().center();
  Affine3d turned = lattice.to_world;
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

TEST_P(PacketKernel, EndsOnSurfacesWithinTheField) {
  for (const Lattice& lattice : tested_lattices())
    for (const bool with_cut : {false, true}) {
      TensorField field = lattice_field(odd_box(), lattice, smooth_tensor(51));
      RayBatch rays = random_rays(field, 40, wavelengths(0.05), 52);
      expect_reference(make_scene(lattice.name + (with_cut ? ", cut" : ", plate"), std::move(field),
                                  surfaces_within(lattice, with_cut), 0, std::move(rays)),
                       0.1);
    }
}

TEST_P(PacketKernel, EndsAtTheGreatestLengthAndNumberOfSteps) {
  for (const Lattice& lattice : tested_lattices()) {
    Scene scene = random_scene(lattice, 0, 0.05, 40);
    scene.settings.max_length = 1.013;
    expect_reference(scene, 0.1);
    scene.settings.max_length = INFINITY;
    scene.settings.max_steps = 7;
    scene.settings.step = 1;
    expect_reference(scene, 0.1);
    const RayBatch fast = traced(scene, scene.rays);
    for (std::size_t i = 0; i < fast.size(); ++i) {
      EXPECT_LE(fast.steps[i], 7u);
      EXPECT_TRUE(fast.end[i] != RayEnd::step_limit || fast.steps[i] == 7);
    }
    EXPECT_GT(std::count(fast.end.begin(), fast.end.end(), RayEnd::step_limit), 0);
  }
}

TEST_P(PacketKernel, EndsAsTheReferenceDoesInOddFields) {
  const TensorFunction smooth = smooth_tensor(53);
  for (const double factor : {1e-41, 1.0, 1e15, std::nan("")}) {
    TensorField field = lattice_field(index_box({-3, 0, 2}, {20, 17, 19}), lattices()[0], [&](const Vector3d& p) {
      return Matrix3d(p.x() < 5 ? Matrix3d(-30 * factor * Matrix3d::Identity()) : Matrix3d(factor * smooth(p)));
    });
    RayBatch rays = random_rays(field, 24, {0.1, -0.1, 0, 1e30, 1e300, INFINITY, NAN}, 54);
    Scene scene = make_scene("factor " + std::to_string(factor), std::move(field), {}, 0, std::move(rays));
    scene.settings.max_steps = 300;
    SCOPED_TRACE(scene.name);
    const RayBatch fast = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
    const RayBatch moved = traced_by_reference(scene, turned_a_little(scene));
    std::size_t compared = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_TRUE(fast.position[i].allFinite() && fast.direction[i].allFinite()) << i;
      const bool follows = std::abs(scene.rays.flexibility[i]) * scene.field.max_norm() * mean_edge < 10;
      if (moved.end[i] != exact.end[i] || !follows) continue;
      ++compared;
      EXPECT_EQ(fast.end[i], exact.end[i]) << "ray " << i << ", s " << scene.rays.flexibility[i];
    }
    EXPECT_TRUE(!(factor <= 1) || compared > exact.size() / 4);
  }
}

/// From zero to values for which no series converges, so that neighbouring rays take different branches of the kernel.
const std::vector<double> unlike_flexibilities{1e-4, 0.3, -30, 0, 0.02, 5, 1e5, -0.1, 1e300, 0.002, 0.6};

/// Scenes in which rays end in every way, after few steps and after many.
std::vector<Scene> unlike_scenes() {
  std::vector<Scene> scenes;
  for (const Lattice& lattice : {lattices()[0], lattices()[2]}) {
    const TensorGrid grid = lattice_grid(odd_box(), lattice, smooth_tensor(21));
    const auto add = [&](const std::string& name, double holes, const Surfaces& surfaces) -> BendingSettings& {
      TensorField field = cubic_field(without_blocks(grid, holes, 22));
      RayBatch rays = random_rays(field, 16, unlike_flexibilities, 23);
      rays.wants_log_radiance_scale = true;
      scenes.push_back(make_scene(lattice.name + ", " + name, std::move(field), surfaces, 0, std::move(rays)));
      scenes.back().settings.max_steps = 200;
      return scenes.back().settings;
    };
    add("dense", 0, {}).step = 1;
    add("sparse", 0.6, {}).max_length = 3;
    add("surfaces", 0.3, surfaces_within(lattice, true)).max_steps = 40;
  }
  return scenes;
}

TEST_P(PacketKernel, RaysDoNotDependOnTheirNeighbours) {
  for (const Scene& scene : unlike_scenes()) {
    SCOPED_TRACE(scene.name);
    const RayBatch all = traced(scene, scene.rays);
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), 0);
    for (const std::size_t i : order) expect_identical(scene, all, {i});

    expect_identical(scene, all, {order.rbegin(), order.rend()});
    Numbers numbers(24);
    for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[numbers.below(i + 1)]);
    expect_identical(scene, all, order);

    // The ray next to rays that end at once, next to rays that stay long, and next to itself.
    const auto latest = std::max_element(all.steps.begin(), all.steps.end()) - all.steps.begin();
    const auto earliest = std::min_element(all.steps.begin(), all.steps.end()) - all.steps.begin();
    std::vector<std::size_t> mixed;
    for (const std::size_t i : order) mixed.insert(mixed.end(), {i, std::size_t(earliest), std::size_t(latest), i});
    expect_identical(scene, all, mixed);
  }
}

/// Λ is the same to single precision; that it is wanted changes no ray.
TEST_P(PacketKernel, KnowsTheChangeOfRadiance) {
  for (const double kick : {1e-3, 0.05, 0.5}) {
    Scene scene = random_scene(lattices()[2], 0, kick, 40);
    SCOPED_TRACE(scene.name);
    const RayBatch plain = traced(scene, scene.rays);
    scene.rays.wants_log_radiance_scale = true;
    const RayBatch all = traced(scene, scene.rays), reference = traced_by_reference(scene, scene.rays);
    double greatest = 0;
    int compared = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_TRUE(identical(all, i, plain, i)) << "ray " << i;
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
TEST_P(PacketKernel, IsotropicTensorsChangeNoRadiance) {
  const TensorFunction smooth = smooth_tensor(41);
  const auto changes = [&](double c) {
    TensorField field = lattice_field(index_box({0, 0, 0}, {24, 24, 24}), lattices()[0], [&](const Vector3d& p) {
      return Matrix3d(0.1 * (smooth(p) + c * p.x() * Matrix3d::Identity()));
    });
    RayBatch rays = random_rays(field, 16, {0.3, -1}, 42);
    rays.wants_log_radiance_scale = true;
    const Scene scene = make_scene("isotropic", std::move(field), {}, 0, std::move(rays));
    return traced(scene, scene.rays).log_radiance_scale;
  };
  const std::vector<double> without = changes(0), with = changes(1);
  for (std::size_t i = 0; i < with.size(); ++i) EXPECT_NEAR(with[i], without[i], 1e-3) << "ray " << i;
  EXPECT_GT(*std::max_element(without.begin(), without.end()), 0.1);
}

TEST_P(PacketKernel, CarriesDifferentials) {
  for (const Lattice& lattice : tested_lattices()) {
    const Vector3d middle = odd_box().cast<double>().center();
    TensorField field = lattice_field(odd_box(), lattice, [&](const Vector3d& p) {
      return Matrix3d(0.02 * (1 + 0.03 * (p - middle).x() - 0.05 * (p - middle).y()) * general_tensor() +
                      0.001 * (p - middle).z() * Matrix3d(Vector3d(1, -2, 0.5).asDiagonal()));
    });
    RayBatch rays = with_differentials(random_rays(field, 40, {0.3, -0.5, 1}, 58));
    expect_differentials(make_scene(lattice.name + ", differentials", std::move(field), surfaces_within(lattice, false),
                                    0, std::move(rays)),
                         1e-3);
  }
}

/// Symmetric tensors, of which five components are stored, bend rays as if there were eight, bit for bit.
TEST_P(PacketKernel, SymmetricTensorsBendRaysAsIfTheyWereGeneral) {
  for (const Lattice& lattice : tested_lattices()) {
    TensorGrid grid =
        without_blocks(lattice_grid(index_box({-13, 5, -30}, {37, 41, 50}), lattice, smooth_tensor(71)), 0.2, 72);
    for (TensorBlock& block : grid.blocks)
      for (Matrix3f& T : block.values) T.triangularView<Eigen::StrictlyUpper>() = T.transpose();
    TensorBlock& block = grid.blocks.front();
    int first = 0;
    while (!block.active[first]) ++first;
    block.values[first].setZero();
    const TensorField symmetric = cubic_field(grid);
    block.values[first](0, 1) = -0.0f;  // Bit for bit, this is not symmetric.
    const TensorField general = cubic_field(grid);
    ASSERT_TRUE(symmetric.is_symmetric() && !general.is_symmetric());
    RayBatch rays = random_rays(symmetric, 16, unlike_flexibilities, 73);
    rays.wants_log_radiance_scale = true;
    for (const RayBatch& batch : {rays, with_differentials(random_rays(symmetric, 8, {0.3, -0.5, 1}, 74))}) {
      const auto trace_in = [&](const TensorField& field) {
        Scene scene = make_scene(lattice.name, field, {}, 0, batch);
        scene.settings.max_steps = 200;
        return traced(scene, batch);
      };
      const RayBatch one = trace_in(symmetric), other = trace_in(general);
      for (std::size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(identical(one, i, other, i)) << i;
    }
  }
}

TEST_P(PacketKernel, BricksOfZerosTakeOneStepEach) {
  for (const Lattice& lattice : lattices()) {
    const auto zero = [](const Vector3d&) { return Matrix3d::Zero().eval(); };
    TensorField field = lattice_field(index_box({-16, 0, 8}, Vector3i::Constant(64)), lattice, zero);
    RayBatch along;
    for (int i = 0; i < 20; ++i) add_bundle(along, field, {-20, 3.7 + i, 12.3 + i}, {1, 0, 0}, {0.1, 0.2, 0.3});
    const Scene scene = make_scene(lattice.name, std::move(field), {}, 0, std::move(along));
    for (const std::uint32_t steps : traced(scene, scene.rays).steps) {
      EXPECT_GE(steps, 8u);
      EXPECT_LE(steps, 9u);  // One more where rounding at the face of entry decides.
    }
  }
}

TEST(PacketKernel, RefusesUnknownInstructionSets) {
  EXPECT_THROW(packets::use_instruction_set("abacus"), std::invalid_argument);
}

/// Other methods, other fields and small tolerances: the same bytes as those of the reference.
TEST(PacketKernel, AllElseIsTracedInDoublePrecision) {
  const auto expect_reference_bytes = [](const Scene& scene) {
    const RayBatch ends = traced(scene, scene.rays), exact = traced_by_reference(scene, scene.rays);
    for (std::size_t i = 0; i < exact.size(); ++i) EXPECT_TRUE(identical(ends, i, exact, i)) << i;
  };
  Scene scene = random_scene(lattices()[0], 0, 0.05, 8);
  for (const BendingMethod method : {BendingMethod::euler, BendingMethod::splitting, BendingMethod::rk4,
                                     BendingMethod::bs23, BendingMethod::dopri5}) {
    scene.settings.method = method;
    expect_reference_bytes(scene);
  }
  scene.settings.method = BendingMethod::splitting4;
  scene.settings.tolerance = 1e-7;
  expect_reference_bytes(scene);
  TensorField linear(lattice_grid(odd_box(), lattices()[0], smooth_tensor(41)));
  expect_reference_bytes(make_scene("linear", std::move(linear), {}, 0, scene.rays));
}

}  // namespace
}  // namespace tensorray
