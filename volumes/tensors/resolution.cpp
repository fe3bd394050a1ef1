#include "volumes/tensors/resolution.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <tbb/parallel_for.h>

#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using Eigen::Vector3i;

Vector3i corner_of_cell(int i) { return {i & 1, i >> 1 & 1, i >> 2 & 1}; }

/// Whether all voxels of the cell that begins at `first` are in the block and active.
bool is_cell(const BlockShape& block, const Vector3i& first) {
  if (first.maxCoeff() + 1 >= TensorBlock::size) return false;
  for (int i = 0; i < 8; ++i) {
    const Vector3i at = first + corner_of_cell(i);
    if (!block.active[static_cast<std::size_t>(TensorBlock::offset(at.x(), at.y(), at.z()))]) return false;
  }
  return true;
}

/// A number for n that looks random.
std::uint32_t scattered(std::size_t n) {
  std::uint64_t x = (n + 1) * 0x9e3779b97f4a7c15u;
  x ^= x >> 31;
  return static_cast<std::uint32_t>(x * 0xbf58476d1ce4e5b9u >> 32);
}

/// ‖T_linear − T_cubic‖ and ‖T_cubic‖; negative: not a cell.
struct Comparison {
  double difference = -1, norm = 0;
};

Comparison compare(TensorSampler& sampler, const TensorField& field, const Vector3i& first) {
  const auto at = [&](const Eigen::Vector3d& index) { return sampler.at(field.to_world() * index); };
  const Eigen::Vector3d index = first.cast<double>();
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 8; ++i) mean += at(index + corner_of_cell(i).cast<double>()) / 8;
  const Eigen::Matrix3d cubic = at(index + Eigen::Vector3d::Constant(0.5));
  return {(mean - cubic).norm(), cubic.norm()};
}

}  // namespace

Resolution measure_resolution(const TensorField& field, const std::vector<BlockShape>& shapes, std::size_t count) {
  std::vector<Comparison> compared(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
    const BlockShape& block = shapes[n * shapes.size() / count];
    const Vector3i first = TensorBlock::position(static_cast<int>(scattered(n) % TensorBlock::voxels));
    if (!is_cell(block, first)) return;
    TensorSampler sampler(field);
    compared[n] = compare(sampler, field, block.origin + first);
  });
  compared.erase(std::remove_if(compared.begin(), compared.end(), [](const auto& c) { return c.difference < 0; }),
                 compared.end());
  Resolution result;
  result.cells = compared.size();
  double squares = 0;
  for (const Comparison& c : compared) squares += c.norm * c.norm;
  if (!(squares > 0)) return result;
  const double norm = std::sqrt(squares / static_cast<double>(compared.size()));
  std::sort(compared.begin(), compared.end(), [](const auto& a, const auto& b) { return a.difference < b.difference; });
  const auto part = [&](std::size_t percent) {
    return compared[percent * (compared.size() - 1) / 100].difference / norm;
  };
  result.median = part(50);
  result.percentile_99 = part(99);
  return result;
}

}  // namespace tensorray
