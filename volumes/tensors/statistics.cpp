#include "volumes/tensors/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/eigenvalues.h"

namespace tensorray {
namespace {

/// Imaginary parts, and negative real parts, below this fraction of a tensor's norm count as rounding errors.
constexpr double min_part = 1e-6;

double spectral_norm(const Eigen::Matrix3d& tensor) {
  return std::sqrt(std::max(0.0, eigenvalues(tensor.transpose() * tensor)[0].real()));
}

/// What is gathered from the voxels of one block.
struct BlockStatistics {
  std::vector<double> norms;
  double real_min = std::numeric_limits<double>::infinity(), real_max = -real_min;
  double imaginary_max = 0, deviator_max = 0;
  std::size_t complex = 0, negative = 0;
  double norm = 0, erased = 0;  ///< Sum of ‖T‖²; sum of the part of it that `absolute` would erase.
};

void add_voxel(const Eigen::Matrix3d& tensor, BlockStatistics& statistics) {
  const double norm = tensor.norm();
  statistics.norms.push_back(norm);
  statistics.norm += norm * norm;
  statistics.erased += erased_norm(tensor, with_eigenvalues(tensor, Eigenvalues::absolute));

  const Eigen::Vector3cd values = eigenvalues(tensor);
  const double imaginary = values.imag().maxCoeff();
  statistics.real_max = std::max(statistics.real_max, values[0].real());
  statistics.real_min = std::min(statistics.real_min, values[2].real());
  statistics.imaginary_max = std::max(statistics.imaginary_max, imaginary);
  statistics.complex += imaginary > min_part * norm;
  statistics.negative += values[2].real() < -min_part * norm;

  const Eigen::Matrix3d deviator = tensor - tensor.trace() / 3 * Eigen::Matrix3d::Identity();
  if (deviator.norm() > statistics.deviator_max)  // The spectral norm is never above the Frobenius norm.
    statistics.deviator_max = std::max(statistics.deviator_max, spectral_norm(deviator));
}

BlockStatistics statistics_of(const TensorBlock& block) {
  BlockStatistics statistics;
  for (int offset = 0; offset < TensorBlock::voxels; ++offset)
    if (block.active[offset]) add_voxel(block.values[offset].cast<double>(), statistics);
  return statistics;
}

/// Sorts `norms` and takes the nearest rank of each percentile.
void take_percentiles(std::vector<double>& norms, FieldStatistics& result) {
  tbb::parallel_sort(norms);
  const double last = static_cast<double>(norms.size() - 1);
  for (std::size_t i = 0; i < result.norm.size(); ++i)
    result.norm[i] = norms[static_cast<std::size_t>(std::lround(FieldStatistics::percentiles[i] / 100 * last))];
}

/// Joins the blocks in their order, so that the result is the same for any number of threads.
void join(const std::vector<BlockStatistics>& blocks, FieldStatistics& result) {
  BlockStatistics all;
  for (const BlockStatistics& block : blocks) {
    all.norms.insert(all.norms.end(), block.norms.begin(), block.norms.end());
    all.real_min = std::min(all.real_min, block.real_min);
    all.real_max = std::max(all.real_max, block.real_max);
    all.imaginary_max = std::max(all.imaginary_max, block.imaginary_max);
    all.deviator_max = std::max(all.deviator_max, block.deviator_max);
    all.complex += block.complex;
    all.negative += block.negative;
    all.norm += block.norm;
    all.erased += block.erased;
  }
  const double count = static_cast<double>(all.norms.size());
  result.real_min = all.real_min;
  result.real_max = all.real_max;
  result.imaginary_max = all.imaginary_max;
  result.deviator_max = all.deviator_max;
  result.complex_fraction = static_cast<double>(all.complex) / count;
  result.negative_fraction = static_cast<double>(all.negative) / count;
  result.absolute_loss = all.norm > 0 ? all.erased / all.norm : 0;
  take_percentiles(all.norms, result);
}

void describe_extent(const TensorGrid& grid, FieldStatistics& result) {
  const TensorField field(grid, {grid.finer.empty() ? Interpolation::linear : Interpolation::cubic});
  result.index_box = grid.active_box();
  result.world_box = field.world_box();
  result.memory_bytes = field.memory_bytes();
}

bool all_finite(const TensorGrid& grid) {
  const auto is_finite = [](const TensorBlock& block) {
    return std::all_of(block.values.begin(), block.values.end(), [](const auto& value) { return value.allFinite(); });
  };
  const std::vector<const TensorBlocks*> levels = levels_of(grid);
  return std::all_of(levels.begin(), levels.end(), [&](const TensorBlocks* blocks) {
    return std::all_of(blocks->begin(), blocks->end(), is_finite);
  });
}

/// Computes all statistics except the numbers of voxels and the voxel size.
void describe_finite(const TensorGrid& grid, FieldStatistics& result) {
  if (grid.active_voxels() == 0) return;
  describe_extent(grid, result);
  result.asymmetry = asymmetry(grid);
  std::vector<BlockStatistics> all;
  for (const TensorBlocks* blocks : levels_of(grid)) {
    const std::size_t first = all.size();
    all.resize(first + blocks->size());
    tbb::parallel_for(std::size_t{0}, blocks->size(),
                      [&](std::size_t i) { all[first + i] = statistics_of((*blocks)[i]); });
  }
  join(all, result);
}

}  // namespace

double FieldStatistics::stable_step(double flexibility) const {
  const double rate = std::abs(flexibility) * deviator_max;
  return rate > 0 ? 1 / rate : std::numeric_limits<double>::infinity();
}

FieldStatistics field_statistics(const TensorGrid& grid) {
  FieldStatistics result;
  for (const TensorBlocks* blocks : levels_of(grid)) {
    result.voxels_of_levels.push_back(active_voxels(shapes_of(*blocks)));
    result.active_voxels += result.voxels_of_levels.back();
  }
  result.voxel_size = grid.to_world.linear().colwise().norm();
  if (all_finite(grid)) {
    describe_finite(grid, result);
  } else {
    TensorGrid finite = grid;
    result.non_finite = remove_non_finite(finite);
    describe_finite(finite, result);
  }
  return result;
}

}  // namespace tensorray
