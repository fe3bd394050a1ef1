#include "volumes/making/field_making.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using Eigen::Vector3i;

constexpr std::size_t judged_blocks = 16;  // From which `automatic` is guessed.

/// What a pass finds in a block.
struct BlockFindings {
  std::size_t non_finite = 0;
  AsymmetrySums asymmetry;
  EigenvalueSums eigenvalues;
};

Eigenvalues guess(const BlockSource& source) {
  AsymmetrySums sums;
  TensorBlock block;
  const std::size_t count = std::min(judged_blocks, source.shapes.size());
  for (std::size_t i = 0; i < count; ++i) {
    read_block(source, i * source.shapes.size() / count, block);
    remove_non_finite(block);
    sums.add(asymmetry_sums(block));
  }
  return automatic_choice(sums.asymmetry());
}

/// One pass over the blocks.
struct Pass {
  BlockSource source;              // `fill` cleans and preprocesses; it changes `shapes` where a voxel is not finite.
  std::vector<BlockShape> shapes;  // Of finite voxels.
  std::vector<BlockFindings> blocks;  // In the order of the blocks.

  Pass(const BlockSource& original, Eigenvalues mode, Eigenvalues chosen);
  Pass(const Pass&) = delete;
  Pass& operator=(const Pass&) = delete;

  BlockFindings sum() const;
};

Pass::Pass(const BlockSource& original, Eigenvalues mode, Eigenvalues chosen)
    : source(original), shapes(original.shapes), blocks(original.shapes.size()) {
  source.fill = [this, fill = original.fill, mode, chosen](std::size_t i, TensorBlock& block) {
    BlockFindings& found = blocks[i];
    fill(i, block);
    found.non_finite = remove_non_finite(block);
    shapes[i].active = block.active;
    if (mode == Eigenvalues::automatic) found.asymmetry = asymmetry_sums(block);
    if (chosen != Eigenvalues::raw) found.eigenvalues = apply_eigenvalues(block, chosen);
  };
}

/// In the order of the blocks, so that the number of threads does not matter.
BlockFindings Pass::sum() const {
  BlockFindings all;
  for (const BlockFindings& block : blocks) {
    all.non_finite += block.non_finite;
    all.asymmetry.add(block.asymmetry);
    all.eigenvalues.add(block.eigenvalues);
  }
  return all;
}

/// The same blocks with other shapes; those without active voxels are left out.
BlockSource with_shapes(const BlockSource& source, const std::vector<BlockShape>& shapes) {
  BlockSource result = source;
  result.shapes.clear();
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (shapes[i].active.none()) continue;
    result.shapes.push_back(shapes[i]);
    numbers.push_back(i);
  }
  result.fill = [fill = source.fill, numbers = std::move(numbers)](std::size_t i, TensorBlock& block) {
    fill(numbers[i], block);
  };
  return result;
}

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

/// Of a cubic field. @param shapes  Of its blocks. Cells between blocks are not compared. Runs on all threads; the
/// result does not depend on their number.
Resolution measure_resolution(const TensorField& field, const std::vector<BlockShape>& shapes) {
  constexpr std::size_t count = 4096;  // Taken evenly from all blocks; enough for a 99th percentile.
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

}  // namespace

MadeField make_field(const BlockSource& source, Eigenvalues mode, const Interpolant& interpolant) {
  Eigenvalues chosen = mode == Eigenvalues::automatic ? guess(source) : mode;
  MadeField result;
  BlockSource current = source;
  while (!current.shapes.empty()) {
    Pass pass(current, mode, chosen);
    result.field.emplace(pass.source, interpolant);
    const BlockFindings found = pass.sum();
    const Eigenvalues right = mode == Eigenvalues::automatic ? automatic_choice(found.asymmetry.asymmetry()) : chosen;
    result.eigenvalues = report_of(found.eigenvalues, chosen);
    if (found.non_finite == 0 && right == chosen) break;
    result.field.reset();  // Its memory is needed.
    result.non_finite += found.non_finite;
    chosen = right;
    current = with_shapes(current, pass.shapes);
  }
  result.voxels = active_voxels(current.shapes);
  if (result.field && result.field->is_cubic()) result.resolution = measure_resolution(*result.field, current.shapes);
  return result;
}

}  // namespace tensorray
