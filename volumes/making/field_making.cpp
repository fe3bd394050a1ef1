#include "volumes/making/field_making.h"

#include <numeric>
#include <utility>
#include <vector>

namespace tensorray {
namespace {

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

constexpr std::size_t compared_cells = 4096;  // Enough for a 99th percentile.

void find_resolution(const std::vector<BlockShape>& shapes, MadeField& made) {
  if (made.field && made.field->is_cubic()) made.resolution = measure_resolution(*made.field, shapes, compared_cells);
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
  find_resolution(current.shapes, result);
  return result;
}

}  // namespace tensorray
