// Tests that fields of symmetric tensors take less memory, and hold the same tensors as others.

#include <array>
#include <limits>
#include <random>

#include "tests/volumes/grid_support.h"
#include "volumes/bricks/brick_layout.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/block_source.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

TensorGrid symmetric_grid(const Vector3i& first, const Vector3i& last) {
  TensorGrid grid =
      dense_grid({first, last}, Eigen::Affine3d::Identity(), [](const Vector3i&) { return Matrix3d::Zero(); });
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (TensorBlock& block : grid.blocks)
    for (int i = 0; i < TensorBlock::voxels; ++i) {
      Eigen::Matrix3f T = Eigen::Matrix3f::Zero();
      if (block.active[i])
        for (int row = 0; row < 3; ++row)
          for (int column = 0; column <= row; ++column) T(row, column) = T(column, row) = normal(random);
      block.values[i] = T;
    }
  return grid;
}

Eigen::Matrix3f& first_tensor(TensorGrid& grid) {
  TensorBlock& block = grid.blocks.front();
  int i = 0;
  while (!block.active[i]) ++i;
  return block.values[i];
}

/// The same field with eight components per voxel. The first tensor must be zero; it gets a −0 above the diagonal.
TensorField general_field(TensorGrid grid) {
  first_tensor(grid)(0, 1) = -0.0f;
  return TensorField(grid);
}

/// Whether values are the same, bit for bit; NaN and zeros may have any sign.
template <class Derived>
bool same(const Eigen::MatrixBase<Derived>& a, const Eigen::MatrixBase<Derived>& b) {
  for (Eigen::Index i = 0; i < a.size(); ++i)
    if (!(a(i) == b(i) || (std::isnan(a(i)) && std::isnan(b(i))))) return false;
  return true;
}

void expect_same(const TensorField& a, const TensorField& b) {
  ASSERT_EQ(a.bricks(), b.bricks());
  for (const Vector3i& at : a.bricks()) {
    const TensorBrick one = a.brick(at), other = b.brick(at);
    EXPECT_TRUE(one.strongest == other.strongest) << at.transpose();
    for (int voxel = 0; voxel < LinearBrick::coefficients; ++voxel)
      ASSERT_TRUE(same(one.tensor(voxel), other.tensor(voxel))) << at.transpose() << ", voxel " << voxel;
  }
}

TEST(SymmetricBricks, TakeTwoThirdsOfTheMemory) {
  TensorGrid grid = symmetric_grid({0, 0, 0}, {64, 64, 64});
  first_tensor(grid).setZero();
  const TensorField symmetric(grid), general = general_field(grid);
  ASSERT_TRUE(symmetric.is_symmetric());
  ASSERT_FALSE(general.is_symmetric());
  EXPECT_LT(static_cast<double>(symmetric.memory_bytes()), 0.67 * static_cast<double>(general.memory_bytes()));
}

TEST(SymmetricBricks, HoldTheSameTensors) {
  TensorGrid grid = symmetric_grid({-11, -3, 5}, {19, 24, 30});
  first_tensor(grid).setZero();
  const float infinity = std::numeric_limits<float>::infinity();
  grid.blocks[7].values[100].setConstant(std::nanf(""));
  grid.blocks[8].values[200].setConstant(infinity);
  grid.blocks[9].values[300] *= 1e-30f;
  grid.blocks[10].values[400] *= 1e30f;
  const TensorField symmetric(grid), general = general_field(grid);
  ASSERT_TRUE(symmetric.is_symmetric());
  ASSERT_FALSE(general.is_symmetric());
  expect_same(symmetric, general);

  std::mt19937 random(2);
  TensorSampler one(symmetric), other(general);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d world = random_point(random, symmetric.voxels().cast<double>());
    EXPECT_TRUE(same(one.at(world), other.at(world))) << world.transpose();
    Eigen::Matrix<double, 3, 2> along;
    along << Vector3d(0.5, -1, 2), Vector3d(1, 0.25, 0);
    std::array<Matrix3d, 2> slopes, others;
    one.at(world, along, slopes);
    other.at(world, along, others);
    EXPECT_TRUE(same(slopes[0], others[0]) && same(slopes[1], others[1])) << world.transpose();
  }
}

TEST(SymmetricBricks, BecomeGeneralOnesWithTheFirstTensorThatIsNotSymmetric) {
  TensorGrid grid = symmetric_grid({0, 0, 0}, {39, 39, 30});
  first_tensor(grid).setZero();
  const TensorField symmetric(grid);
  grid.blocks[grid.blocks.size() - 9].values[77](2, 1) += 1;
  const TensorField late(grid), early = general_field(grid);
  EXPECT_TRUE(symmetric.is_symmetric());
  EXPECT_FALSE(late.is_symmetric());
  expect_same(late, early);
  expect_same(TensorField(source_of(std::move(grid))), early);
}

}  // namespace
}  // namespace tensorray
