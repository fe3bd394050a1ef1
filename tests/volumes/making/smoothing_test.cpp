#include "volumes/making/smoothing.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/volumes/grid_support.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Matrix3d;
using Eigen::Matrix3f;
using Eigen::Vector3d;
using Eigen::Vector3i;

const AlignedBox3i smoothed_box(Vector3i(-13, -3, 5), Vector3i(25, 14, 30));

TensorGrid grid_of(const AlignedBox3i& voxels, const std::function<Matrix3d(const Vector3i&)>& value) {
  return dense_grid(voxels, Eigen::Affine3d(Eigen::Scaling(0.5, 1.0, 3.0)), value);
}

/// Holes, from single voxels to whole blocks, so that sums along one axis pass through voxels and blocks without value.
void make_holes(TensorGrid& grid) {
  for (TensorBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Vector3i i = block.origin + TensorBlock::position(offset);
      const bool is_hole = (i.x() * 7 + i.y() * 5 + i.z() * 3) % 4 == 0 || (i.x() >= 0 && i.x() < 8 && i.y() >= 0);
      if (!is_hole) continue;
      block.active.reset(offset);
      block.values[offset].setZero();
    }
  remove_empty_blocks(grid);
}

/// The definition, without separating axes.
Matrix3d mean_about(const TensorGrid& grid, const Vector3i& middle, double deviation) {
  Matrix3d sum = Matrix3d::Zero();
  double weights = 0;
  for_each_active(grid, [&](const Vector3i& i, const Matrix3f& value) {
    if ((i - middle).cwiseAbs().maxCoeff() > 4 * deviation) return;
    const double weight = std::exp(-(i - middle).cast<double>().squaredNorm() / (2 * deviation * deviation));
    sum += weight * value.cast<double>();
    weights += weight;
  });
  return sum / weights;
}

TEST(Smoothing, ConstantsStayAtBordersAndBesideHoles) {
  Matrix3d constant;
  constant << 1.1, 0.3, -7, 1e-9, 3e5, 0.7, -0.2, 1.0 / 3, 13;
  TensorGrid grid = grid_of(smoothed_box, [&](const Vector3i&) { return constant; });
  make_holes(grid);
  for (const double deviation : {0.3, 1.0, 2.7}) {
    TensorGrid smoothed = grid;
    smooth(smoothed, deviation);
    expect_same_blocks(smoothed, grid);
  }
}

TEST(Smoothing, IsTheMeanOfActiveVoxels) {
  TensorGrid grid = grid_of(smoothed_box, waves);
  make_holes(grid);
  for (const double deviation : {0.7, 2.5}) {
    TensorGrid smoothed = grid;
    smooth(smoothed, deviation);
    for (const Vector3i& i : {Vector3i(-13, -3, 7), Vector3i(9, 7, 17), Vector3i(-1, 14, 30), Vector3i(25, 0, 6)}) {
      const Matrix3f value = *find(smoothed, i);
      EXPECT_LT((value.cast<double>() - mean_about(grid, i, deviation)).cwiseAbs().maxCoeff(), 1e-7) << i.transpose();
    }
  }
}

TEST(Smoothing, LevelsAreRefused) {
  TensorGrid grid = grid_of(smoothed_box, waves);
  grid.finer.push_back(grid.blocks);
  EXPECT_NO_THROW(smooth(grid, 0));
  EXPECT_THROW(smooth(grid, 1), std::invalid_argument);
}

TEST(Smoothing, DoesNotDependOnThreads) {
  TensorGrid many = grid_of(smoothed_box, waves), one = many;
  smooth(many, 2);
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  smooth(one, 2);
  expect_same_blocks(many, one);
}

TEST(Smoothing, RejectsDeviationsOutOfRange) {
  TensorGrid grid = grid_of(smoothed_box, waves);
  for (const double deviation : {-1.0, 20.5, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(smooth(grid, deviation), std::invalid_argument) << deviation;
}

}  // namespace
}  // namespace tensorray
