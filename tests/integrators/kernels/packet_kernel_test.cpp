// Tests that the result of a ray does not depend on the other rays, and that the work is proportional to the length of
// its path.

#include "integrators/kernels/packet_kernel.h"

#include <numeric>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "tests/integrators/packet_support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

using PacketKernel = EveryInstructionSet;
INSTANTIATE_TEST_SUITE_P(All, PacketKernel, test::instruction_sets(), instruction_set_name);

/// From zero to values for which no series converges, so that neighbouring rays take different branches of the kernel.
std::vector<double> unlike_flexibilities() { return {1e-4, 0.3, -30, 0, 0.02, 5, 1e5, -0.1, 1e300, 0.002, 0.6}; }

/// Scenes in which rays end in every way, after few steps and after many.
std::vector<Scene> unlike_scenes() {
  std::vector<Scene> scenes;
  for (const Lattice& lattice : {lattices()[0], lattices()[2]})
    for (const double step : {0.0, 1.0}) {
      const auto add = [&](const std::string& name, double holes, const Surfaces& surfaces) -> Scene& {
        const TensorGrid grid = lattice_grid(index_box({-13, 5, -30}, {37, 41, 50}), lattice, smooth_tensor(21));
        TensorField field(without_blocks(grid, holes, 22));
        RayBatch rays = random_rays(field, 16, unlike_flexibilities(), 23);
        scenes.push_back(make_scene(lattice.name + ", " + name, std::move(field), surfaces, step, std::move(rays)));
        scenes.back().settings.max_steps = 200;
        return scenes.back();
      };
      const Vector3d middle = lattice.to_world * Vector3d(5, 25, -5);
      Surfaces surfaces;
      surfaces.plate = plate_across({0.5, -0.3, -1}, 0);
      surfaces.plate->center = middle;
      surfaces.plate->size = {0.8, 0.8};
      Eigen::Affine3d cut = lattice.to_world;
      cut.translation() = middle;
      surfaces.cut = box_mesh({Vector3d(-12, -13, -14), Vector3d(12, 13, 14)}, cut);
      add("dense", 0, {});
      add("sparse", 0.6, {}).settings.max_length = 3;
      add("surfaces", 0.3, surfaces).settings.max_steps = 40;
    }
  return scenes;
}

/// Rays `order` of a batch.
RayBatch chosen(const RayBatch& rays, const std::vector<std::size_t>& order) {
  RayBatch result;
  for (const std::size_t i : order) result.add(rays.position[i], rays.direction[i], rays.flexibility[i]);
  return result;
}

void expect_identical(const Scene& scene, const RayBatch& all, const std::vector<std::size_t>& order) {
  const RayBatch some = traced(scene, chosen(scene.rays, order));
  std::size_t differ = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (identical(some, i, all, order[i]) || ++differ > 3) continue;
    ADD_FAILURE() << "ray " << order[i] << ", s " << scene.rays.flexibility[order[i]]
                  << ":\n  here: " << description(scene.field, some, i)
                  << "\n  in the batch: " << description(scene.field, all, order[i]);
  }
  EXPECT_EQ(differ, 0u);
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

TEST_P(PacketKernel, RaysDoNotDependOnThreads) {
  for (const Scene& scene : unlike_scenes()) {
    SCOPED_TRACE(scene.name);
    const RayBatch all = traced(scene, scene.rays);
    for (const std::size_t size : {1, 7, 32, 100}) {
      std::vector<RayBatch> parts((all.size() + size - 1) / size);
      tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
        std::vector<std::size_t> order;
        for (std::size_t i = part * size; i < std::min(all.size(), (part + 1) * size); ++i) order.push_back(i);
        parts[part] = traced(scene, chosen(scene.rays, order));
      });
      for (std::size_t i = 0; i < all.size(); ++i) EXPECT_TRUE(identical(parts[i / size], i % size, all, i)) << i;
    }
  }
}

TEST(PacketKernel, InstructionSetsAgree) {
  ASSERT_FALSE(packets::instruction_sets().empty());
  for (const Lattice& lattice : lattices()) {
    TensorField field(lattice_grid(index_box({-13, 5, -30}, {37, 41, 50}), lattice, smooth_tensor(25)));
    RayBatch rays = random_rays(field, 60, {0.001, 0.02, -0.1}, 26);
    const Scene scene = make_scene(lattice.name, std::move(field), {}, 0, std::move(rays));
    const RayBatch moved = traced_by_reference(scene, turned_a_little(scene));
    const RayBatch exact = traced_by_reference(scene, scene.rays);
    const RayBatch best = traced(scene, scene.rays);
    for (const std::string& name : packets::instruction_sets()) {
      packets::use_instruction_set(name);
      const RayBatch other = traced(scene, scene.rays);
      for (std::size_t i = 0; i < other.size(); ++i)
        EXPECT_TRUE(!agree(moved, exact, i) || agree(other, best, i)) << name << ", ray " << i;
    }
    packets::use_instruction_set({});
  }
}

TEST(PacketKernel, RefusesUnknownInstructionSets) {
  EXPECT_THROW(packets::use_instruction_set("abacus"), std::invalid_argument);
  EXPECT_GE(packets::lane_count(), 1);
}

TEST_P(PacketKernel, FieldsDependOnNothingBeyondTheBricksOfTheWay) {
  // The voxels outside the brick differ strongly between the fields; the kernel may read only those in the apron.
  const TensorFunction smooth = smooth_tensor(27);
  const auto field = [&](double far) {
    return TensorField(lattice_grid(index_box({-24, -24, -24}, {48, 48, 48}), lattices()[0], [&](const Vector3d& p) {
      const bool near = p.minCoeff() >= 0 && p.maxCoeff() <= TensorBrick::cells;
      return Matrix3d(near ? smooth(p) : far * Matrix3d(smooth(p) + general_tensor()));
    }));
  };
  // Light ends on a box within the brick.
  Surfaces surfaces;
  surfaces.obstacles.push_back(box_mesh({Vector3d::Constant(1.5), Vector3d::Constant(6.5)}, lattices()[0].to_world));
  std::vector<RayBatch> ends;
  for (const double far : {0.0, 1.0, 1e30}) {
    TensorField volume = field(far);
    Numbers numbers(28);
    RayBatch rays;
    for (int i = 0; i < 300; ++i) {
      const Vector3d along = numbers.direction();
      add_bundle(rays, volume, numbers.in({Vector3d::Constant(2), Vector3d::Constant(6)}), along, {0.1, 0.3, 30});
    }
    ends.push_back(traced(make_scene("", std::move(volume), surfaces, 0.5, rays), rays));
  }
  for (std::size_t i = 0; i < ends[0].size(); ++i) {
    EXPECT_EQ(ends[0].end[i], RayEnd::obstacle);
    EXPECT_TRUE(identical(ends[1], i, ends[0], i)) << i;
    EXPECT_TRUE(identical(ends[2], i, ends[0], i)) << i;
  }
}

/// Rays through a dense field. Each begins one voxel before the field.
Scene dense_scene(int voxels) {
  TensorField field(lattice_grid(index_box({0, 0, 0}, Vector3i::Constant(voxels)), lattices()[0], smooth_tensor(29)));
  Numbers numbers(30);
  RayBatch rays;
  for (int i = 0; i < 16; ++i) {
    const Eigen::Vector2d from = voxels * numbers.two_between(0.2, 0.8);
    add_bundle(rays, field, {from.x(), from.y(), -1}, {numbers.between(-0.1, 0.1), numbers.between(-0.1, 0.1), 1},
               {0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007, 0.008});
  }
  return make_scene("", std::move(field), {}, 0, std::move(rays));
}

/// Number of samples, divided by the number that the lengths of the paths within the field require.
double samples_over_expected(Scene& scene, double step) {
  scene.settings.step = step;
  const RayBatch ends = traced(scene, scene.rays);
  double expected = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const double within = ends.length[i] / mean_edge - 1 / std::abs(scene.rays.direction[i].z());
    EXPECT_GT(within, scene.field.voxels().sizes().z() - 1e-3);
    expected += within / (step > 0 ? step : 0.5);
  }
  return static_cast<double>(ends.tensor_samples) / expected;
}

TEST_P(PacketKernel, SamplesAreInProportionToTheWay) {
  // A few more samples are taken where rays begin and end. Steps of one voxel in 64 voxels are too few to hide these.
  Scene small = dense_scene(64), large = dense_scene(128);
  for (const double step : {0.0, 0.25, 0.5}) {
    EXPECT_NEAR(samples_over_expected(small, step), 1, 0.1) << step;
    EXPECT_NEAR(samples_over_expected(large, step), 1, 0.1) << step;
  }
  EXPECT_NEAR(samples_over_expected(large, 1), 1, 0.1);
}

/// The number of faces between bricks that the segment from one point to another crosses, index space.
int faces_between_bricks(const Vector3d& from, const Vector3d& to) {
  int faces = 0;
  for (int axis = 0; axis < 3; ++axis)
    faces +=
        std::abs(int(std::floor(from[axis] / TensorBrick::cells)) - int(std::floor(to[axis] / TensorBrick::cells)));
  return faces;
}

TEST_P(PacketKernel, BricksOfZerosTakeOneStepEach) {
  for (const Lattice& lattice : lattices()) {
    const auto zero = [](const Vector3d&) { return Matrix3d::Zero().eval(); };
    TensorField field(lattice_grid(index_box({-16, 0, 8}, Vector3i::Constant(64)), lattice, zero));
    RayBatch along;
    for (int i = 0; i < 20; ++i) add_bundle(along, field, {-20, 3.7 + i, 12.3 + i}, {1, 0, 0}, {0.1, 0.2, 0.3});
    const Scene scene = make_scene(lattice.name, std::move(field), {}, 0, std::move(along));
    for (const std::uint32_t steps : traced(scene, scene.rays).steps) {
      EXPECT_GE(steps, 8u);
      EXPECT_LE(steps, 9u);  // One more where rounding at the face of entry decides.
    }

    const RayBatch oblique = random_rays(scene.field, 100, {0.1, 0.2, 0.3}, 31), ends = traced(scene, oblique);
    for (std::size_t i = 0; i < ends.size(); ++i) {
      // From where light enters; the path is straight.
      const auto entry = scene.geometry.crossing(Surface::bounds, true, oblique.position[i], oblique.direction[i]);
      const Vector3d from = entry && !scene.field.contains(oblique.position[i])
                                ? Vector3d(oblique.position[i] + entry->distance * oblique.direction[i])
                                : oblique.position[i];
      const int faces = faces_between_bricks(scene.field.to_index() * from, scene.field.to_index() * ends.position[i]);
      EXPECT_LE(ends.steps[i], faces + 2u) << "ray " << i;  // One more where rounding at the last face decides.
    }
  }
}

TEST_P(PacketKernel, EmptyBricksAreNotSampled) {
  const TensorGrid dense =
      lattice_grid(index_box({0, 0, 0}, Vector3i::Constant(128)), lattices()[0], smooth_tensor(32));
  TensorField field(without_blocks(dense, 0.7, 33));
  RayBatch rays;
  Numbers numbers(34);
  for (int i = 0; i < 100; ++i)
    add_bundle(rays, field, {-3, numbers.between(1, 119), numbers.between(1, 119)}, {1, 0, 0}, {0});
  const Scene scene = make_scene("", std::move(field), {}, 0, std::move(rays));
  const RayBatch ends = traced(scene, scene.rays);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Vector3d start = scene.field.to_index() * scene.rays.position[i];
    std::uint32_t most = 1;
    for (int brick = 0; brick < 16; ++brick) {
      const Vector3i at(brick, int(start.y()) / TensorBrick::cells, int(start.z()) / TensorBrick::cells);
      most += scene.field.brick(at).strongest > 0 ? 17 : 1;  // 16 steps of ½ voxel, and one that two bricks share.
    }
    EXPECT_LE(ends.steps[i], most) << "ray " << i;
  }
}

}  // namespace
}  // namespace tensorray
