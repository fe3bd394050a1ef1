#include "volumes/making/noise.h"

#include <random>

#include <gmock/gmock.h>

namespace tensorray {
namespace {

/// Waves of 20 voxels, and noise of this deviation in each component.
TensorGrid waves(double amplitude, double deviation) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  TensorGrid grid = dense_grid({Eigen::Vector3i::Zero(), Eigen::Vector3i::Constant(39)}, Eigen::Affine3d::Identity(),
                               [&](const Eigen::Vector3i& at) {
                                 const Eigen::Vector3d phase = 0.314 * at.cast<double>();
                                 return Eigen::Matrix3d(amplitude * phase.array().sin().matrix().asDiagonal());
                               });
  for (TensorBlock& block : grid.blocks)
    for (Eigen::Matrix3f& value : block.values)
      value += (deviation * Eigen::Matrix3d::NullaryExpr([&] { return normal(random); })).cast<float>();
  return grid;
}

TEST(Noise, IsKeptAndStructureIsNot) {
  TensorGrid noise = waves(0, 0.1), both = waves(1, 0.1), structure = waves(1, 0);
  EXPECT_NEAR(variation(noise), 0.3, 0.003);
  for (TensorGrid* grid : {&noise, &both, &structure}) keep_noise(*grid);
  EXPECT_NEAR(variation(noise), 0.3, 0.005);
  EXPECT_NEAR(variation(both), 0.3, 0.03);
  EXPECT_LT(variation(structure), 0.12);  // The ends of the waves, at the grid's faces, and what curves.
}

/// Neighbours of what is left have nothing in common, and the mean is isotropic.
TEST(Noise, HasNoOrder) {
  TensorGrid grid = waves(1, 0.1);
  keep_noise(grid);
  double product = 0, square = 0;
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const TensorBlock& block : grid.blocks)
    for (std::size_t i = 0; i + 1 < TensorBlock::voxels; i += 2) {
      product += double{block.values[i](0, 1)} * block.values[i + 1](0, 1);
      square += double{block.values[i](0, 1)} * block.values[i](0, 1);
      mean += block.values[i].cast<double>() / 32000;
    }
  EXPECT_LT(std::abs(product), 0.03 * square);
  EXPECT_LT((mean - mean.trace() / 3 * Eigen::Matrix3d::Identity()).norm(), 0.01);
}

}  // namespace
}  // namespace tensorray
