#include "volumes/making/field_making.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <utility>

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

/// What a pass finds in the blocks of a level, in their order.
struct LevelFindings {
  std::vector<BlockShape> shapes;  // Of finite voxels.
  std::vector<BlockFindings> blocks;

  explicit LevelFindings(const std::vector<BlockShape>& all) : shapes(all), blocks(all.size()) {}
};

/// One pass over the blocks.
struct Pass {
  BlockSource source;  // `fill` cleans and preprocesses; it changes `shapes` where a voxel is not finite.
  std::deque<LevelFindings> levels;

  Pass(const BlockSource& original, Eigenvalues mode, Eigenvalues chosen);
  Pass(const Pass&) = delete;
  Pass& operator=(const Pass&) = delete;

  BlockFindings sum() const;
};

Pass::Pass(const BlockSource& original, Eigenvalues mode, Eigenvalues chosen) : source(original) {
  const auto watch = [&](const std::vector<BlockShape>& shapes, auto& fill) {
    levels.emplace_back(shapes);
    fill = [level = &levels.back(), fill, mode, chosen](std::size_t i, TensorBlock& block) {
      BlockFindings& found = level->blocks[i];
      fill(i, block);
      found.non_finite = remove_non_finite(block);
      level->shapes[i].active = block.active;
      if (mode == Eigenvalues::automatic) found.asymmetry = asymmetry_sums(block);
      if (chosen != Eigenvalues::raw) found.eigenvalues = apply_eigenvalues(block, chosen);
    };
  };
  watch(original.shapes, source.fill);
  for (BlockLevel& level : source.finer) watch(level.shapes, level.fill);
}

/// In the order of the blocks, so that the number of threads does not matter.
BlockFindings Pass::sum() const {
  BlockFindings all;
  for (const LevelFindings& level : levels)
    for (const BlockFindings& block : level.blocks) {
      all.non_finite += block.non_finite;
      all.asymmetry.add(block.asymmetry);
      all.eigenvalues.add(block.eigenvalues);
    }
  return all;
}

/// Gives the blocks other shapes; those without active voxels are left out.
template <class Fill>
void set_shapes(const std::vector<BlockShape>& from, std::vector<BlockShape>& shapes, Fill& fill) {
  shapes.clear();
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (from[i].active.none()) continue;
    shapes.push_back(from[i]);
    numbers.push_back(i);
  }
  fill = [fill, numbers = std::move(numbers)](std::size_t i, TensorBlock& block) { fill(numbers[i], block); };
}

/// The same blocks without the voxels that are not finite.
BlockSource with_finite(const BlockSource& source, const Pass& pass) {
  BlockSource result = source;
  set_shapes(pass.levels[0].shapes, result.shapes, result.fill);
  for (std::size_t i = 0; i < result.finer.size(); ++i)
    set_shapes(pass.levels[i + 1].shapes, result.finer[i].shapes, result.finer[i].fill);
  return result;
}

Vector3i corner_of_cell(int i) { return {i & 1, i >> 1 & 1, i >> 2 & 1}; }

/// Whether all voxels of the cell that begins at `first`, and `about` voxels about it, are in the block and active.
bool is_cell(const BlockShape& block, const Vector3i& first, int about) {
  const Vector3i from = first - Vector3i::Constant(about), to = first + Vector3i::Constant(1 + about);
  if (from.minCoeff() < 0 || to.maxCoeff() >= TensorBlock::size) return false;
  for (int x = from.x(); x <= to.x(); ++x)
    for (int y = from.y(); y <= to.y(); ++y)
      for (int z = from.z(); z <= to.z(); ++z)
        if (!block.active[static_cast<std::size_t>(TensorBlock::offset(x, y, z))]) return false;
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

/// LeafBrick::scale in the cell that begins at a voxel of level 0.
double scale_at(const TensorField& field, const Vector3i& voxel) {
  const Vector3i brick = voxel.unaryExpr([](int i) { return i >> 3; });
  const Eigen::Vector3f from = (voxel - TensorBlock::size * brick).cast<float>();
  return double{field.leaf(brick, {from.x(), from.y(), from.z()}).scale};
}

/// @param first  A voxel of level 0, at which the cell of the finest level begins.
Comparison compare(TensorSampler& sampler, const TensorField& field, const Vector3i& first) {
  const auto at = [&](const Eigen::Vector3d& index) { return sampler.at(field.to_world() * index); };
  const Eigen::Vector3d index = first.cast<double>();
  const double cell = 1 / scale_at(field, first);
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 8; ++i) mean += at(index + cell * corner_of_cell(i).cast<double>()) / 8;
  const Eigen::Matrix3d cubic = at(index + Eigen::Vector3d::Constant(cell / 2));
  return {(mean - cubic).norm(), cubic.norm()};
}

/// Of a cubic field. @param shapes  Of its blocks. Cells between blocks are not compared. @param about  Voxels about
/// a cell that must be active. Runs on all threads; the result does not depend on their number.
Resolution measure_resolution(const TensorField& field, const std::vector<BlockShape>& shapes, int about) {
  constexpr std::size_t count = 8192;  // Taken evenly from all blocks; enough for a 99th percentile.
  std::vector<Comparison> compared(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
    const BlockShape& block = shapes[n * shapes.size() / count];
    const Vector3i first = TensorBlock::position(static_cast<int>(scattered(n) % TensorBlock::voxels));
    if (!is_cell(block, first, about)) return;
    TensorSampler sampler(field);
    compared[n] = compare(sampler, field, block.origin + first);
  });
  compared.erase(std::remove_if(compared.begin(), compared.end(), [](const auto& c) { return c.difference < 0; }),
                 compared.end());
  constexpr std::size_t few = 100;
  if (about > 0 && compared.size() < few) return measure_resolution(field, shapes, 0);
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
  result.percentile_90 = part(90);
  result.percentile_99 = part(99);
  return result;
}

}  // namespace

MadeField make_field(const BlockSource& source, Eigenvalues mode, const Interpolant& interpolant) {
  if (mode == Eigenvalues::automatic && source.metadata.count(negated_key) > 0) mode = Eigenvalues::raw;
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
    current = with_finite(current, pass);
  }
  result.voxels = active_voxels(current.shapes);
  for (const BlockLevel& level : current.finer) result.finer_voxels.push_back(active_voxels(level.shapes));
  if (result.field && result.field->is_cubic())
    result.resolution = measure_resolution(*result.field, current.shapes, 1);
  return result;
}

}  // namespace tensorray
