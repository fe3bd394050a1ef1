#include "volumes/bricks/tensor_field.h"

#include <limits>
#include <random>

#include "tests/volumes/grid_support.h"
#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/brick_layout.h"
#include "volumes/grids/block_source.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

Matrix3d identity(const Vector3i&) { return Matrix3d::Identity(); }

Matrix3d x_times_identity(const Vector3i& index) { return index.x() * Matrix3d::Identity(); }

/// Linear along each axis, but not in all together: trilinear interpolation reproduces it exactly.
Matrix3d trilinear(const Vector3d& p) {
  const Matrix3d a = by_rows({1, 2, 3, 4, 5, 6, 7, 8, 9}), b = by_rows({0, 1, -1, 2, 0, -2, 1, 1, 3});
  const Matrix3d c = by_rows({-1, 0, 2, 0, 1, 0, 3, 0, -2});
  return a + p.x() * b + p.y() * c + p.z() * (a - c) + p.x() * p.y() * p.z() * b;
}

TEST(TensorField, InterpolatesTrilinearFunctionsExactlyAcrossBricks) {
  const AlignedBox3i box(Vector3i(-11, -3, 5), Vector3i(9, 14, 30));  // Several bricks, no multiple of 8.
  const TensorField field(
      dense_grid(box, sheared_transform(), [](const Vector3i& i) { return trilinear(i.cast<double>() / 8); }));
  TensorSampler sampler(field);
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d index = random_point(random, field.index_bounds());
    EXPECT_LT((sampler.at(field.to_world() * index) - trilinear(index / 8)).norm(), 1e-5 * trilinear(index / 8).norm());
  }
  EXPECT_EQ(sampler.samples(), 2000u);
}

TEST(TensorField, InactiveVoxelsCountAsZero) {
  TensorGrid grid = unit_voxels({0, 0, 0}, {2, 2, 2}, identity);
  clear_voxels(grid.blocks, [](const Vector3i& index) { return index == Vector3i(1, 1, 1); });
  const TensorField field(grid);
  TensorSampler sampler(field);
  EXPECT_DOUBLE_EQ(sampler.at({1, 1, 1})(0, 0), 0);
  EXPECT_DOUBLE_EQ(sampler.at({0.5, 1, 1})(0, 0), 0.5);
  EXPECT_DOUBLE_EQ(sampler.at({0, 0, 0})(0, 0), 1);
}

TEST(TensorField, ASingleVoxelAcrossIsOneVoxelThick) {
  const TensorField field(unit_voxels({0, 5, 0}, {9, 5, 9}, x_times_identity));
  EXPECT_EQ(field.index_bounds().min().y(), 4.5);
  EXPECT_EQ(field.index_bounds().max().y(), 5.5);
  TensorSampler sampler(field);
  for (const double y : {4.5, 4.9, 5.0, 5.5}) EXPECT_DOUBLE_EQ(sampler.at({3.5, y, 2})(0, 0), 3.5);
  Eigen::Matrix<double, 3, 2> along;
  along << Vector3d::UnitY(), Vector3d::UnitX();
  std::array<Matrix3d, 2> derivatives;
  sampler.at({3.5, 5.2, 2}, along, derivatives);
  EXPECT_TRUE(derivatives[0].isZero());
  EXPECT_DOUBLE_EQ(derivatives[1](0, 0), 1);
}

TEST(TensorField, MemoryFollowsActiveVoxelsNotTheExtent) {
  const auto cluster = [](int at) { return unit_voxels(Vector3i::Constant(at), Vector3i::Constant(at + 7), identity); };
  TensorGrid grid = cluster(0);
  const TensorGrid far = cluster(1 << 24);
  grid.blocks.insert(grid.blocks.end(), far.blocks.begin(), far.blocks.end());
  const TensorField field(grid);
  EXPECT_LT(field.memory_bytes(), 1u << 20);
  TensorSampler sampler(field);
  EXPECT_EQ(sampler.at({3.5, 3.5, 3.5})(1, 1), 1);
  EXPECT_EQ(sampler.at(Vector3d::Constant((1 << 24) + 3.5))(1, 1), 1);
  EXPECT_TRUE(sampler.at({1e6, 1e6, 1e6}).isZero());
}

TEST(TensorField, PointsOutsideAreTakenToTheExtent) {
  const TensorField field(unit_voxels({0, 0, 0}, {4, 4, 4}, x_times_identity));
  TensorSampler sampler(field);
  EXPECT_DOUBLE_EQ(sampler.at({9, 2, 2})(0, 0), 4);
  EXPECT_DOUBLE_EQ(sampler.at({-1e300, 2, 2})(0, 0), 0);
  EXPECT_TRUE(sampler.at(Vector3d::Constant(std::nan(""))).allFinite());
}

TEST(TensorField, KnowsItsGreatestNormAndTheStrongestDeviatorOfABrickAtAnyScale) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (const double scale : {1e-37, 1e-30, 1e-20, 1e-13, 1e-6, 1.0, 1e6, 1e14, 1e15, 1e20, 1e37})
    for (const double isotropic : {0.0, 1.0}) {
      TensorGrid grid = unit_voxels({0, 0, 0}, {15, 8, 8}, identity);
      double greatest_norm = 0;
      for_each_value(grid, [&](Matrix3f& value) {
        const Matrix3d noise = Matrix3d::NullaryExpr([&] { return (1 - 0.9 * isotropic) * normal(random); });
        value = (scale * (isotropic * Matrix3d::Identity() + noise)).cast<float>();
        greatest_norm = std::max(greatest_norm, value.cast<double>().norm());
      });
      const TensorField field(grid);
      EXPECT_NEAR(field.max_norm() / greatest_norm, 1, 1e-7) << scale;
      for (int x = 0; x < 2; ++x) {
        const TensorBrick brick = field.brick({x, 0, 0});
        double greatest = 0;
        for (int voxel = 0; voxel < LinearBrick::coefficients; ++voxel) {
          const Matrix3d T = brick.tensor(voxel);
          greatest = std::max(greatest, (T - T.trace() / 3 * Matrix3d::Identity()).norm());
        }
        EXPECT_GE(brick.strongest, greatest * (1 + 9e-6)) << scale;
        EXPECT_LE(brick.strongest, greatest * (1 + 2e-5)) << scale;
      }
    }
}

TEST(TensorField, BricksThatBendNothingHaveNoDeviator) {
  for (const double value : {0.0, 3.0, 1e-30, 1e38}) {
    const TensorField field(
        unit_voxels({0, 0, 0}, {7, 7, 7}, [&](const Vector3i&) { return Matrix3d(value * Matrix3d::Identity()); }));
    EXPECT_EQ(field.brick({0, 0, 0}).strongest, 0);
  }
}

TEST(TensorField, WhatIsNotFiniteDoesNotHideTheStrongestDeviator) {
  const float infinity = std::numeric_limits<float>::infinity();
  TensorGrid grid = unit_voxels({0, 0, 0}, {7, 7, 7},
                                [](const Vector3i& i) { return Matrix3d(i.x() * Vector3d::UnitX().asDiagonal()); });
  grid.blocks[0].values[100].setConstant(std::nanf(""));
  grid.blocks[0].values[200](1, 1) = infinity;
  EXPECT_NEAR(TensorField(grid).brick({0, 0, 0}).strongest, 7 * std::sqrt(2.0 / 3), 1e-3);
  grid.blocks[0].values[300](0, 1) = infinity;
  EXPECT_EQ(TensorField(grid).brick({0, 0, 0}).strongest, infinity);
}

TEST(TensorField, RefusesWhatCannotBeTraced) {
  EXPECT_THROW(TensorField{TensorGrid{}}, std::invalid_argument);
  TensorGrid flat = unit_voxels({0, 0, 0}, {1, 1, 1}, identity);
  flat.to_world.linear().col(2).setZero();
  EXPECT_THROW(TensorField{flat}, std::invalid_argument);
}

Matrix3f& first_tensor(TensorGrid& grid) {
  TensorBlock& block = grid.blocks.front();
  return block.values[block.active._Find_first()];
}

/// Symmetric tensors, of which the first is zero.
TensorGrid symmetric_grid(const Vector3i& first, const Vector3i& last) {
  TensorGrid grid = unit_voxels(first, last, identity);
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for_each_value(grid, [&](Matrix3f& value) {
    const Matrix3f half = Matrix3f::NullaryExpr([&] { return normal(random); });
    value = half + half.transpose();
  });
  first_tensor(grid).setZero();
  return grid;
}

/// The same field with eight components per voxel: the first tensor, which is zero, gets a −0 above the diagonal.
TensorField general_field(TensorGrid grid) {
  first_tensor(grid)(0, 1) = -0.0f;
  return TensorField(grid);
}

/// Whether values are the same, bit for bit; NaN and zeros may have any sign.
bool same(const Matrix3d& a, const Matrix3d& b) {
  return (a.array() == b.array() || (a.array().isNaN() && b.array().isNaN())).all();
}

void expect_same_tensors(const TensorField& a, const TensorField& b) {
  ASSERT_EQ(a.bricks(), b.bricks());
  for (const Vector3i& at : a.bricks()) {
    const TensorBrick one = a.brick(at), other = b.brick(at);
    EXPECT_TRUE(one.strongest == other.strongest) << at.transpose();
    for (int voxel = 0; voxel < LinearBrick::coefficients; ++voxel)
      ASSERT_TRUE(same(one.tensor(voxel), other.tensor(voxel))) << at.transpose() << ", voxel " << voxel;
  }
}

TEST(SymmetricBricks, HoldTheSameTensorsInTwoThirdsOfTheMemory) {
  TensorGrid grid = symmetric_grid({-11, -3, 5}, {19, 24, 30});
  const float infinity = std::numeric_limits<float>::infinity();
  grid.blocks[7].values[100].setConstant(std::nanf(""));
  grid.blocks[8].values[200].setConstant(infinity);
  grid.blocks[9].values[300] *= 1e-30f;
  grid.blocks[10].values[400] *= 1e30f;
  const TensorField symmetric(grid), general = general_field(grid);
  ASSERT_TRUE(symmetric.is_symmetric());
  ASSERT_FALSE(general.is_symmetric());
  expect_same_tensors(symmetric, general);
  EXPECT_LT(static_cast<double>(symmetric.memory_bytes()), 0.67 * static_cast<double>(general.memory_bytes()));

  const auto along = (Eigen::Matrix<double, 3, 2>() << Vector3d(0.5, -1, 2), Vector3d(1, 0.25, 0)).finished();
  std::mt19937 random(2);
  TensorSampler one(symmetric), other(general);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d world = random_point(random, symmetric.voxels().cast<double>());
    EXPECT_TRUE(same(one.at(world), other.at(world))) << world.transpose();
    std::array<Matrix3d, 2> slopes, others;
    one.at(world, along, slopes);
    other.at(world, along, others);
    EXPECT_TRUE(same(slopes[0], others[0]) && same(slopes[1], others[1])) << world.transpose();
  }
}

TEST(SymmetricBricks, BecomeGeneralOnesWithTheFirstTensorThatIsNotSymmetric) {
  TensorGrid grid = symmetric_grid({0, 0, 0}, {39, 39, 30});
  const TensorField symmetric(grid);
  grid.blocks[grid.blocks.size() - 9].values[77](2, 1) += 1;
  const TensorField late(grid), early = general_field(grid);
  EXPECT_TRUE(symmetric.is_symmetric());
  EXPECT_FALSE(late.is_symmetric());
  expect_same_tensors(late, early);
  expect_same_tensors(TensorField(source_of(std::move(grid))), early);
}

/// Expects that each brick has its number and that the places around the bricks have none.
void expect_finds(const std::vector<Vector3i>& bricks) {
  const BrickIndex index(bricks);
  for (std::size_t i = 0; i < bricks.size(); ++i) ASSERT_EQ(index.find(bricks[i]), i) << bricks[i].transpose();
  for (const Vector3i& brick : bricks)
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        const Vector3i near = brick + step * Vector3i::Unit(axis);
        const auto there = std::find(bricks.begin(), bricks.end(), near);
        const auto expected = there == bricks.end() ? BrickIndex::missing : std::uint32_t(there - bricks.begin());
        ASSERT_EQ(index.find(near), expected) << near.transpose();
      }
}

/// The bricks of a box in random order, without a fraction of them.
std::vector<Vector3i> box_of_bricks(const Vector3i& first, const Vector3i& size, double taken) {
  std::mt19937 random(1);
  std::bernoulli_distribution leaves(taken);
  std::vector<Vector3i> bricks;
  for (int x = 0; x < size.x(); ++x)
    for (int y = 0; y < size.y(); ++y)
      for (int z = 0; z < size.z(); ++z)
        if (!leaves(random)) bricks.emplace_back(first + Vector3i(x, y, z));
  std::shuffle(bricks.begin(), bricks.end(), random);
  return bricks;
}

TEST(BrickIndex, FindsBricksOfBoxes) {
  expect_finds({Vector3i(0, 0, 0)});
  expect_finds({Vector3i(-1, -1, -1)});
  expect_finds(box_of_bricks({-3, -7, 2}, {5, 9, 4}, 0));
  expect_finds(box_of_bricks({-3, -7, 2}, {5, 9, 4}, 0.9));
  expect_finds(box_of_bricks({1 << 27, -(1 << 27), -2}, {3, 4, 5}, 0.5));
  expect_finds(box_of_bricks({0, 0, -30}, {1, 1, 60}, 0.3));
}

TEST(BrickIndex, FindsBricksFarApart) {
  constexpr int far = 1 << 28;
  std::vector<Vector3i> bricks{{far, far, far}, {-far, -far, -far}, {far, -far, 0}, {0, 0, 0}, {-1, 0, far}};
  expect_finds(bricks);
  for (const Vector3i& corner : {Vector3i(-far, far, 5), Vector3i(1000, -2000, 3000)})
    for (const Vector3i& brick : box_of_bricks(corner, {4, 4, 4}, 0.2)) bricks.push_back(brick);
  expect_finds(bricks);
}

TEST(BrickIndex, HasNothingAnywhereElse) {
  constexpr int least = std::numeric_limits<int>::min(), greatest = std::numeric_limits<int>::max();
  for (const BrickIndex& index :
       {BrickIndex(), BrickIndex({{0, 0, 0}, {1, 1, 1}}), BrickIndex({{0, 0, 0}, {999, 0, 0}})})
    for (const int x : {least, -2, 2, greatest})
      for (const int y : {least, -1, 0, greatest})
        for (const int z : {least, 0, 1, greatest}) EXPECT_EQ(index.find({x, y, z}), BrickIndex::missing);
}

}  // namespace
}  // namespace tensorray
