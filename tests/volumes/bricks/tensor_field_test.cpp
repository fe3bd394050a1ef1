#include "volumes/bricks/tensor_field.h"

#include <limits>
#include <random>

#include "tests/volumes/grid_support.h"
#include "volumes/bricks/brick_index.h"
#include "volumes/bricks/brick_layout.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

/// Voxels from index `min` to `max`, of edge 1.
TensorGrid voxels(const Vector3i& min, const Vector3i& max, const std::function<Matrix3d(const Vector3i&)>& value) {
  return dense_grid({min, max}, Eigen::Affine3d::Identity(), value);
}

Matrix3d identity(const Vector3i&) { return Matrix3d::Identity(); }

Matrix3d x_times_identity(const Vector3i& index) { return index.x() * Matrix3d::Identity(); }

/// Linear along each axis, but not in all together: trilinear interpolation reproduces it exactly.
Matrix3d trilinear(const Vector3d& p) {
  Matrix3d a, b, c;
  a << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  b << 0, 1, -1, 2, 0, -2, 1, 1, 3;
  c << -1, 0, 2, 0, 1, 0, 3, 0, -2;
  return a + p.x() * b + p.y() * c + p.z() * (a - c) + p.x() * p.y() * p.z() * b;
}

Eigen::Affine3d oblique() {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.linear() =
      Eigen::AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).toRotationMatrix() * Vector3d(0.5, 1, 2).asDiagonal();
  transform.translation() = Vector3d(10, -20, 30);
  return transform;
}

TEST(TensorField, InterpolatesTrilinearFunctionsExactlyAcrossBricks) {
  const AlignedBox3i box(Vector3i(-11, -3, 5),
                         Vector3i(9, 14, 30));  // Several bricks, negative indices, no multiple of 8.
  const TensorGrid grid = dense_grid(box, oblique(), [](const Vector3i& i) { return trilinear(i.cast<double>() / 8); });
  const TensorField field(grid);
  TensorSampler sampler(field);
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d index = random_point(random, field.index_bounds());
    EXPECT_LT((sampler.at(oblique() * index) - trilinear(index / 8)).norm(), 1e-5 * trilinear(index / 8).norm());
  }
  EXPECT_EQ(sampler.samples(), 2000u);
}

TEST(TensorField, InactiveVoxelsCountAsZero) {
  TensorGrid grid = voxels({0, 0, 0}, {2, 2, 2}, identity);
  const int middle = TensorBlock::offset(1, 1, 1);
  grid.blocks[0].active.reset(middle);
  grid.blocks[0].values[middle].setZero();
  const TensorField field(grid);
  TensorSampler sampler(field);
  EXPECT_DOUBLE_EQ(sampler.at({1, 1, 1})(0, 0), 0);
  EXPECT_DOUBLE_EQ(sampler.at({0.5, 1, 1})(0, 0), 0.5);
  EXPECT_DOUBLE_EQ(sampler.at({0, 0, 0})(0, 0), 1);
}

TEST(TensorField, ASingleVoxelAcrossIsOneVoxelThick) {
  const TensorField field(voxels({0, 5, 0}, {9, 5, 9}, x_times_identity));
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
  const auto cluster = [](int at) { return voxels(Vector3i::Constant(at), Vector3i::Constant(at + 7), identity); };
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
  const TensorField field(voxels({0, 0, 0}, {4, 4, 4}, x_times_identity));
  TensorSampler sampler(field);
  EXPECT_DOUBLE_EQ(sampler.at({9, 2, 2})(0, 0), 4);
  EXPECT_DOUBLE_EQ(sampler.at({-1e300, 2, 2})(0, 0), 0);
  EXPECT_TRUE(sampler.at(Vector3d::Constant(std::nan(""))).allFinite());
}

TEST(TensorField, KnowsItsGreatestNorm) {
  const TensorField field(voxels({0, 0, 0}, {4, 4, 4}, [](const Vector3i& i) {
    return Matrix3d((i.sum() == 12 ? -2.5 : 1) * Matrix3d::Identity());
  }));
  EXPECT_NEAR(field.max_norm(), 2.5 * std::sqrt(3.0), 1e-6);
}

/// The Frobenius norm, in double precision, of the tensor of a voxel.
double deviator(const TensorBrick& brick, int voxel) {
  const Matrix3d T = brick.tensor(voxel);
  return (T - T.trace() / 3 * Matrix3d::Identity()).norm();
}

TEST(TensorField, KnowsTheStrongestDeviatorOfABrickAtAnyScale) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (const double scale : {1e-37, 1e-30, 1e-20, 1e-13, 1e-6, 1.0, 1e6, 1e14, 1e15, 1e20, 1e37})
    for (const double isotropic : {0.0, 1.0}) {
      const TensorField field(voxels({0, 0, 0}, {15, 8, 8}, [&](const Vector3i&) {
        Matrix3d T = isotropic * Matrix3d::Identity();
        for (int i = 0; i < 9; ++i) T(i / 3, i % 3) += (1 - 0.9 * isotropic) * normal(random);
        return Matrix3d(scale * T);
      }));
      for (int x = 0; x < 2; ++x) {
        const TensorBrick brick = field.brick({x, 0, 0});
        double greatest = 0;
        for (int voxel = 0; voxel < LinearBrick::coefficients; ++voxel)
          greatest = std::max(greatest, deviator(brick, voxel));
        EXPECT_GE(brick.strongest, greatest * (1 + 9e-6)) << scale;
        EXPECT_LE(brick.strongest, greatest * (1 + 2e-5)) << scale;
      }
    }
}

TEST(TensorField, BricksThatBendNothingHaveNoDeviator) {
  for (const double value : {0.0, 3.0, 1e-30, 1e38}) {
    const TensorField field(
        voxels({0, 0, 0}, {7, 7, 7}, [&](const Vector3i&) { return Matrix3d(value * Matrix3d::Identity()); }));
    EXPECT_EQ(field.brick({0, 0, 0}).strongest, 0);
  }
}

TEST(TensorField, WhatIsNotFiniteDoesNotHideTheStrongestDeviator) {
  const float infinity = std::numeric_limits<float>::infinity();
  TensorGrid grid =
      voxels({0, 0, 0}, {7, 7, 7}, [](const Vector3i& i) { return Matrix3d(i.x() * Vector3d::UnitX().asDiagonal()); });
  grid.blocks[0].values[100].setConstant(std::nanf(""));
  grid.blocks[0].values[200](1, 1) = infinity;
  EXPECT_NEAR(TensorField(grid).brick({0, 0, 0}).strongest, 7 * std::sqrt(2.0 / 3), 1e-3);
  grid.blocks[0].values[300](0, 1) = infinity;
  EXPECT_EQ(TensorField(grid).brick({0, 0, 0}).strongest, infinity);
}

TEST(TensorField, RefusesWhatCannotBeTraced) {
  EXPECT_THROW(TensorField{TensorGrid{}}, std::invalid_argument);
  TensorGrid flat = voxels({0, 0, 0}, {1, 1, 1}, identity);
  flat.to_world.linear().col(2).setZero();
  EXPECT_THROW(TensorField{flat}, std::invalid_argument);
}

TEST(TensorGrid, NonFiniteVoxelsAreRemovedAndCounted) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  TensorGrid grid = voxels({0, 0, 0}, {9, 0, 0}, [&](const Vector3i& i) {
    return Matrix3d::Constant(i.x() == 3 ? nan : i.x() >= 8 ? infinity : 1).eval();
  });
  EXPECT_EQ(remove_non_finite(grid), 3u);
  EXPECT_EQ(grid.active_voxels(), 7u);
  EXPECT_EQ(grid.blocks.size(), 1u);  // The second block has no active voxel left.
  EXPECT_EQ(remove_non_finite(grid), 0u);
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
