#include "volumes/making/noise.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "volumes/making/smoothing.h"

namespace tensorray {
namespace {

template <class Grid, class Visit>
void for_each_active(Grid& grid, const Visit& visit) {
  for (std::size_t i = 0; i < grid.blocks.size(); ++i)
    for (std::size_t offset = 0; offset < TensorBlock::voxels; ++offset)
      if (grid.blocks[i].active[offset]) visit(i, offset, grid.blocks[i].values[offset]);
}

Eigen::Matrix3d mean_of(const TensorGrid& grid) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for_each_active(grid, [&](std::size_t, std::size_t, const Eigen::Matrix3f& value) { sum += value.cast<double>(); });
  return sum / static_cast<double>(std::max<std::size_t>(1, grid.active_voxels()));
}

/// What a Gaussian of one voxel leaves of the deviation of independent noise: 1 − 2 w₀ + Σ w², of the three axes.
double left_of_noise() {
  double sum = 0, squares = 0;
  for (int i = -4; i <= 4; ++i) {
    const double weight = std::exp(-0.5 * i * i);
    sum += weight;
    squares += weight * weight;
  }
  return std::sqrt(1 - 2 / std::pow(sum, 3) + std::pow(squares / (sum * sum), 3));
}

}  // namespace

double variation(const TensorGrid& grid) {
  const Eigen::Matrix3d mean = mean_of(grid);
  double sum = 0;
  for_each_active(grid, [&](std::size_t, std::size_t, const Eigen::Matrix3f& value) {
    sum += (value.cast<double>() - mean).squaredNorm();
  });
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, grid.active_voxels())));
}

void keep_noise(TensorGrid& grid) {
  if (!grid.finer.empty())
    throw std::invalid_argument(
        "noise: a field of several levels was not measured at its voxels; give one of one level");
  const Eigen::Matrix3f middle = (mean_of(grid).trace() / 3 * Eigen::Matrix3d::Identity()).cast<float>();
  TensorGrid smoothed = grid;
  smooth(smoothed, 1);
  const auto gain = static_cast<float>(1 / left_of_noise());
  std::vector<Eigen::Matrix3f> noise;
  noise.reserve(grid.active_voxels());
  for_each_active(grid, [&](std::size_t block, std::size_t offset, const Eigen::Matrix3f& value) {
    noise.push_back(gain * (value - smoothed.blocks[block].values[offset]));
  });
  std::mt19937_64 random(1);  // std::shuffle is not the same everywhere.
  for (std::size_t i = noise.size(); i > 1; --i) std::swap(noise[i - 1], noise[random() % i]);
  std::size_t next = 0;
  for_each_active(grid, [&](std::size_t, std::size_t, Eigen::Matrix3f& value) { value = middle + noise[next++]; });
}

}  // namespace tensorray
