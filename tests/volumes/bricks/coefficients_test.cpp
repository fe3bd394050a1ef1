// Bricks are made slab by slab, over blocks that are not needed any more.

#include "volumes/bricks/coefficients.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "volumes/grids/block_source.h"

namespace tensorray {
namespace {

using Eigen::Vector3i;

/// Blocks with gaps along all axes, and voxels that are missing; the last plane along x has no cell of its own.
std::vector<BlockShape> shapes_with_gaps() {
  std::vector<BlockShape> shapes;
  for (const Vector3i& place : {Vector3i(0, 0, 0),
                                {0, 0, 1},
                                {0, 1, 0},
                                {1, 0, 0},
                                {2, 1, 2},
                                {3, 1, 2},
                                {6, 0, 0},
                                {6, 1, 0},
                                {7, 0, 0},
                                {7, 2, 1},
                                {8, 0, 0},
                                {8, 2, 2}}) {
    BlockShape shape;
    shape.origin = TensorBlock::size * place;
    for (int i = 0; i < TensorBlock::voxels; ++i)
      shape.active[i] = place.x() < 8 ? i % 11 != 3 : TensorBlock::position(i).x() == 0;
    shapes.push_back(shape);
  }
  return shapes;
}

struct MadeBricks {
  BrickMemory bricks;
  std::vector<float> strongest;
};

/// @param most  Places of a slab.
MadeBricks make(const BlockTable& table, const Interpolant& interpolant, bool symmetric, std::size_t most) {
  const int components = symmetric ? TensorBrick::symmetric : TensorBrick::general;
  const Eigen::AlignedBox3i extent = active_box(table.shapes);
  CoefficientBricks bricks = coefficient_bricks(table, extent, interpolant);
  bricks.slabs = slabs_of(bricks.places, most);
  MadeBricks made{brick_memory({bricks}, interpolant.between, components), {}};
  const BrickMemory blocks = blocks_within(made.bricks, bricks);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (std::size_t i = 0; i < table.places.size(); ++i) {
    TensorBlock block{};
    for (int voxel = 0; voxel < TensorBlock::voxels; ++voxel)
      if (table.shapes[i].active[voxel]) {
        const Eigen::Matrix3f T = Eigen::Matrix3f::NullaryExpr([&] { return uniform(random); });
        block.values[voxel] = symmetric ? Eigen::Matrix3f(T + T.transpose()) : T;
      }
    EXPECT_TRUE(place_values(block, components, blocks.brick(bricks.index.find(table.places[i]))));
  }
  const Coefficients field{bricks, extent, interpolant, blocks};
  continue_values(field);
  made.strongest = make_coefficients(field, made.bricks);
  keep_bricks(made.bricks, bricks.count);
  return made;
}

TEST(CoefficientSlabs, OfAnySizeGiveTheSameBricks) {
  const std::vector<BlockShape> shapes = shapes_with_gaps();
  const BlockTable table(shapes);
  for (const Interpolant& interpolant :
       {Interpolant{}, Interpolant{Interpolation::cubic, Border::fade}, {Interpolation::cubic, Border::extend}})
    for (const bool symmetric : {true, false}) {
      const MadeBricks whole = make(table, interpolant, symmetric, 1 << 20);
      ASSERT_GT(whole.bricks.count, 20u);
      for (const std::size_t most : {1, 12, 30}) {
        const MadeBricks made = make(table, interpolant, symmetric, most);
        ASSERT_EQ(made.bricks.count, whole.bricks.count);
        EXPECT_EQ(made.strongest, whole.strongest) << most;
        EXPECT_TRUE(std::equal(whole.bricks.brick(0), whole.bricks.brick(whole.bricks.count), made.bricks.brick(0)))
            << "slabs of " << most << " places";
      }
    }
}

}  // namespace
}  // namespace tensorray
