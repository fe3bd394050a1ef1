#include "volumes/bricks/coefficients.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Vector3i;

constexpr int edge = TensorBlock::size;

/// 1 / (4 − 1 / (4 − …)): the elimination of (1, 4, 1).
struct Elimination {
  static constexpr int count = 16;  // The further ones are the same in single precision.

  float factors[count];

  Elimination() {
    double factor = 0;
    for (float& rounded : factors) rounded = static_cast<float>(factor = 1 / (4 - factor));
  }
  float operator[](int i) const { return factors[std::min(i, count - 1)]; }
};

/// Solves (c[i−1] + 4 c[i] + c[i+1]) / 6 = f[i] for a run of `width` numbers each, in place. @param continues_before,
/// continues_after  Whether coefficients beyond an end continue as a cubic polynomial, or, of fewer than three, as a
/// line; otherwise they are zero. With c, δ⁴c = 0 about the second voxel, so that δ²c = δ²f and c = f − δ²f / 6 there.
template <int width>
void solve_run(float* const* run, int count, bool continues_before, bool continues_after) {
  static const Elimination elimination;
  using Numbers = Eigen::Array<float, width, 1>;
  const auto at = [&](int i) { return Eigen::Map<Numbers>(run[i]); };
  const auto second_difference = [&](int i) { return Numbers(at(i - 1) - 2 * at(i) + at(i + 1)); };
  if (continues_before && continues_after && count == 3) {
    const Numbers sixth = second_difference(1) / 6;
    for (int i = 0; i < count; ++i) at(i) -= sixth;
    return;
  }
  const bool cubic_before = continues_before && count >= 3, cubic_after = continues_after && count >= 3;
  const int first = cubic_before ? 1 : continues_before ? 0 : -1;  // The last one that is known before the others.
  const int last = cubic_after ? count - 2 : continues_after ? count - 1 : count;
  Numbers second, second_last;
  if (cubic_before) second = at(1);
  if (cubic_after) second_last = at(count - 2);
  const Numbers known = cubic_before ? Numbers(second - second_difference(1) / 6) : Numbers(Numbers::Zero());
  if (cubic_after) at(count - 2) -= second_difference(count - 2) / 6;
  if (cubic_before) at(1) = known;
  for (int i = first + 1; i < last; ++i) {
    const float factor = elimination[i - first - 1];
    if (i == 0)
      at(i) *= 6 * factor;
    else
      at(i) = (6 * at(i) - at(i - 1)) * factor;
  }
  for (int i = last - 1; i > first; --i)
    if (i + 1 < count) at(i) -= elimination[i - first - 1] * at(i + 1);
  if (cubic_before) at(0) = 6 * second - 4 * at(1) - at(2);
  if (cubic_after) at(count - 1) = 6 * second_last - 4 * at(count - 2) - at(count - 3);
}

/// A column of blocks along an axis, without gaps.
struct Column {
  std::vector<std::uint32_t> blocks;
};

/// The voxels of a column on a line along its axis: `set(i)` says whether voxel i has a coefficient, and `free(i)`
/// whether it may have one.
struct Runs {
  int axis, begin, count;  // Index of the first voxel along the axis, and number of voxels.
  const Eigen::AlignedBox3i& extent;
  Border border;

  /// Calls solve(from, length, continues_before, continues_after) for each run.
  template <class Set, class Free, class Solve>
  void visit(const Set& set, const Free& free, const Solve& solve) const {
    const auto extends = [&](int i) { return border == Border::extend && (i < 0 || i >= count || free(i)); };
    for (int from = 0; from < count;) {
      if (!set(from)) {
        ++from;
        continue;
      }
      int end = from + 1;
      while (end < count && set(end)) ++end;
      solve(from, end - from, extends(from - 1) || begin + from == extent.min()[axis],
            extends(end) || begin + end - 1 == extent.max()[axis]);
      from = end;
    }
  }
};

/// Solves the runs of a line of voxels or of rows of eight voxels along z. `number(i)` is the number, in block
/// i / 8, of what is at place i of the line.
template <int components, int voxels, class Set, class Free, class Number>
void solve_line(const Column& column, const Runs& runs, const BrickMemory& memory, const Set& set, const Free& free,
                const Number& number, std::vector<float*>& pointers) {
  runs.visit(set, free, [&](int from, int length, bool continues_before, bool continues_after) {
    pointers.resize(2 * static_cast<std::size_t>(length));
    float** const bending = pointers.data();
    float** const trailing = bending + length;
    for (int i = 0; i < length; ++i) {
      float* const block = memory.brick(column.blocks[static_cast<std::size_t>((from + i) / edge)]);
      const int at = number((from + i) % edge);
      bending[i] = block + CoefficientBlock::bending_offset(components, at);
      trailing[i] = block + CoefficientBlock::trailing_offset(components) + at;
    }
    solve_run<voxels * components>(bending, length, continues_before, continues_after);
    solve_run<voxels>(trailing, length, continues_before, continues_after);
  });
}

/// The rows of voxels along z at a line along x or y, as masks.
struct LineOfRows {
  const CoefficientBricks& bricks;
  const Column& column;
  bool along_x;
  int across, count;

  std::uint8_t row(const std::vector<VoxelMask>& masks, int i) const {
    const int within = i % edge, at = along_x ? within * edge + across : across * edge + within;
    return masks[column.blocks[static_cast<std::size_t>(i / edge)]][static_cast<std::size_t>(at)];
  }
  std::uint8_t filled(int i) const { return row(bricks.filled, i); }
  std::uint8_t free(int i) const { return bricks.free.empty() ? std::uint8_t{0xff} : row(bricks.free, i); }

  /// Whether the lanes of the rows with coefficients have the same runs; the others are zero, and stay so.
  bool is_uniform() const {
    std::uint8_t lanes = bricks.free.empty() ? 0xff : 0;
    for (int i = 0; i < count; ++i) {
      if (lanes == 0) lanes = filled(i);
      if (filled(i) != 0 && filled(i) != lanes) return false;
    }
    for (int i = 0; i < count; ++i)
      if ((free(i) & lanes) != 0 && (free(i) & lanes) != lanes) return false;
    return true;
  }
};

/// Solves the lines of a column along x or y: eight neighbours along z together where they have the same runs.
template <int components>
void solve_across(const CoefficientBricks& bricks, const Column& column, const Runs& runs, const BrickMemory& memory) {
  std::vector<float*> pointers;
  const bool along_x = runs.axis == 0;
  for (int across = 0; across < edge; ++across) {
    const LineOfRows line{bricks, column, along_x, across, runs.count};
    const auto number = [&](int i, int z) {
      return along_x ? CoefficientBlock::coefficient(i, across, z) : CoefficientBlock::coefficient(across, i, z);
    };
    if (line.is_uniform())
      solve_line<components, edge>(
          column, runs, memory, [&](int i) { return line.filled(i) != 0; }, [&](int i) { return line.free(i) != 0; },
          [&](int i) { return number(i, 0); }, pointers);
    else
      for (int z = 0; z < edge; ++z)
        solve_line<components, 1>(
            column, runs, memory, [&](int i) { return (line.filled(i) >> z & 1) != 0; },
            [&](int i) { return (line.free(i) >> z & 1) != 0; }, [&](int i) { return number(i, z); }, pointers);
  }
}

/// Solves the lines of a column along z.
template <int components>
void solve_along_z(const CoefficientBricks& bricks, const Column& column, const Runs& runs, const BrickMemory& memory) {
  std::vector<float*> pointers;
  for (int line = 0; line < edge * edge; ++line) {
    const auto is_in = [&](const std::vector<VoxelMask>& masks, int i) {
      const VoxelMask& mask = masks[column.blocks[static_cast<std::size_t>(i / edge)]];
      return (mask[static_cast<std::size_t>(line)] >> i % edge & 1) != 0;
    };
    solve_line<components, 1>(
        column, runs, memory, [&](int i) { return is_in(bricks.filled, i); },
        [&](int i) { return bricks.free.empty() || is_in(bricks.free, i); }, [&](int i) { return line * edge + i; },
        pointers);
  }
}

/// The blocks of the column that begins with a block; none if another block is before it.
Column column_of(const CoefficientBricks& bricks, std::size_t first, int axis) {
  Column column;
  const Vector3i along = Vector3i::Unit(axis);
  Vector3i place = bricks.places[first];
  if (bricks.index.find(place - along) != BrickIndex::missing) return column;
  for (std::uint32_t block; (block = bricks.index.find(place)) != BrickIndex::missing; place += along)
    column.blocks.push_back(block);
  return column;
}

template <int components>
void solve_columns(int axis, const Coefficients& field, const PlaceNumbers& numbers) {
  tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t i) {
    const Column column = column_of(field.bricks, numbers[i], axis);
    if (column.blocks.empty()) return;
    const int begin = edge * field.bricks.places[numbers[i]][axis];
    const int count = edge * static_cast<int>(column.blocks.size());
    const Runs runs{axis, begin, count, field.extent, field.interpolant.border};
    if (axis == 2)
      solve_along_z<components>(field.bricks, column, runs, field.blocks);
    else
      solve_across<components>(field.bricks, column, runs, field.blocks);
  });
}

/// Where the blocks begin in the memory, in floats: so far behind that the bricks of a slab end before the blocks of
/// the slab before it, and on a page. Blocks of places without bricks are behind all others, whatever their slab.
/// @param brick  Floats of a brick.
std::size_t begin_of_blocks(const CoefficientBricks& bricks, std::size_t brick, int components) {
  const auto block = static_cast<std::size_t>(CoefficientBlock::stored_floats(components));
  std::size_t begin = 0, first_before = 0;
  for (const PlaceNumbers& slab : bricks.slabs) {
    std::size_t first = bricks.count, end = 0;
    for (const std::size_t i : slab) {
      if (i >= bricks.count) continue;
      first = std::min(first, i);
      end = std::max(end, i + 1);
    }
    if (end * brick > first_before * block) begin = std::max(begin, end * brick - first_before * block);
    if (end > 0) first_before = first;
  }
  constexpr std::size_t page = 4096 / sizeof(float);
  return (begin + page - 1) / page * page;
}

/// In double precision, for values of any size; NaN counts as zero.
double max_squared_norm(const TensorBlock& block) {
  double greatest = 0;
  for (const Eigen::Matrix3f& value : block.values) greatest = std::max(greatest, value.cast<double>().squaredNorm());
  return greatest;
}

/// @param norm  The greatest squared norm of a block's tensors in single precision.
double squared_norm(float norm, const TensorBlock& block) {
  return norm > min_square && norm < max_square ? double{norm} : max_squared_norm(block);
}

std::uint32_t bits_of(float number) {
  std::uint32_t bits;
  std::memcpy(&bits, &number, sizeof bits);
  return bits;
}

template <int components>
std::optional<double> place(const TensorBlock& block, float* values) {
  std::uint32_t asymmetry = 0;
  float greatest = 0;
  const auto square = [](float x) { return x * x; };
  for (int voxel = 0; voxel < TensorBlock::voxels; ++voxel) {
    const float* const T = block.values[voxel].data();
    asymmetry |= (bits_of(T[1]) ^ bits_of(T[3])) | (bits_of(T[2]) ^ bits_of(T[6])) | (bits_of(T[5]) ^ bits_of(T[7]));
    const float bending[] = {T[0] - T[8], T[1], T[2], T[3], T[4] - T[8], T[5], T[6], T[7]};
    float* const to = values + CoefficientBlock::bending_offset(components, voxel);
    if constexpr (components == TensorBrick::general)
      std::copy_n(bending, components, to);
    else
      for (const int i : {0, 1, 2, 4, 5}) to[TensorBrick::stored_component(components, i)] = bending[i];
    values[CoefficientBlock::trailing_offset(components) + voxel] = T[8];
    const float even = square(T[2]) + square(T[6]);
    const float odd = (square(T[1]) + square(T[5])) + (square(T[3]) + square(T[7]));
    const float norm = (((square(T[0]) + square(T[4])) + even) + odd) + square(T[8]);
    greatest = greatest < norm ? norm : greatest;
  }
  if (components == TensorBrick::symmetric && asymmetry != 0) return std::nullopt;
  return squared_norm(greatest, block);
}

/// (3 − √3) / 6: where all voxels of a half space have the value 1, this is that of the spline, whose coefficients
/// beyond are zero, at the first voxel beyond. It falls to zero from there without a change of sign, and hardly rings
/// within.
constexpr float faded = 0.21132487f;

/// The continuation to the voxel at `index`, if known voxels lead there: the mean of those along which most are known.
std::optional<StoredTensor> continuation(const Vector3i& index, const Coefficients& field,
                                         const std::vector<VoxelMask>& known) {
  const int longest = field.interpolant.border == Border::extend ? 2 : 1;
  int most = 1, count = 0;
  StoredTensor sum = StoredTensor::Zero();
  for (int direction = 0; direction < 6; ++direction) {
    const Vector3i along = (direction % 2 ? 1 : -1) * Vector3i::Unit(direction / 2);
    StoredTensor values[2];
    int length = 0;
    for (; length < longest; ++length) {
      const auto voxel = find_voxel(field.bricks, known, index + (length + 1) * along);
      if (!voxel) break;
      values[length] = read_coefficient(field.blocks, *voxel);
    }
    if (length < most) continue;
    if (length > most) {
      most = length;
      count = 0;
      sum.setZero();
    }
    sum += length == 2 ? StoredTensor(2 * values[0] - values[1]) : values[0];
    ++count;
  }
  if (count == 0) return std::nullopt;
  return StoredTensor(sum * ((field.interpolant.border == Border::fade ? faded : 1.0f) / static_cast<float>(count)));
}

/// Continues values to the voxels of a block that known ones lead to. @return the voxels that are known now.
VoxelMask continue_block(std::size_t block, const Coefficients& field, const std::vector<VoxelMask>& known) {
  VoxelMask result = known[block];
  for (int x = 0; x < TensorBlock::size; ++x)
    for (int y = 0; y < TensorBlock::size; ++y)
      for (int z = 0; z < TensorBlock::size; ++z) {
        if (!is_set(field.bricks.filled[block], x, y, z) || is_set(known[block], x, y, z)) continue;
        const Vector3i index = TensorBlock::size * field.bricks.places[block] + Vector3i(x, y, z);
        const auto value = continuation(index, field, known);
        if (!value) continue;
        write_coefficient<CoefficientBlock>(*value, field.blocks.components, field.blocks.brick(block),
                                            CoefficientBlock::coefficient(x, y, z));
        std::uint8_t& row = result[static_cast<std::size_t>(x * TensorBlock::size + y)];
        row = static_cast<std::uint8_t>(row | 1u << z);
      }
  return result;
}

}  // namespace

BrickMemory brick_memory(const std::vector<CoefficientBricks>& levels, Interpolation between, int components) {
  const auto brick = static_cast<std::size_t>(between == Interpolation::linear ? LinearBrick::stored_floats(components)
                                                                               : CubicBrick::stored_floats(components));
  const std::size_t block = static_cast<std::size_t>(CoefficientBlock::stored_floats(components));
  std::size_t first = 0, floats = 0;
  for (const CoefficientBricks& level : levels) {
    floats = std::max(floats, first * brick + begin_of_blocks(level, brick, components) + level.places.size() * block);
    first += level.count;
  }
  return make_bricks((floats + brick - 1) / brick, static_cast<int>(brick), components);
}

BrickMemory bricks_from(const BrickMemory& memory, std::size_t first, std::size_t count) {
  BrickMemory bricks = memory;
  bricks.count = count;
  bricks.floats = std::shared_ptr<float[]>(memory.floats, memory.brick(first));
  return bricks;
}

BrickMemory blocks_within(const BrickMemory& memory, const CoefficientBricks& bricks) {
  BrickMemory blocks;
  blocks.components = memory.components;
  blocks.count = bricks.places.size();
  blocks.stride = static_cast<std::size_t>(CoefficientBlock::stored_floats(memory.components));
  const std::size_t begin = begin_of_blocks(bricks, memory.stride, memory.components);
  blocks.floats = std::shared_ptr<float[]>(memory.floats, memory.floats.get() + begin);
  return blocks;
}

std::vector<float> make_coefficients(const Coefficients& field, const BrickMemory& result) {
  const auto solve = [&](int axis, const PlaceNumbers& numbers) {
    field.blocks.components == TensorBrick::symmetric ? solve_columns<TensorBrick::symmetric>(axis, field, numbers)
                                                      : solve_columns<TensorBrick::general>(axis, field, numbers);
  };
  const std::vector<PlaceNumbers>& slabs = field.bricks.slabs;
  std::vector<float> strongest(field.bricks.count);
  const bool is_cubic = field.interpolant.between == Interpolation::cubic;
  for (std::size_t i = 0; is_cubic && i < slabs.size(); ++i) solve(0, slabs[i]);
  for (std::size_t i = 0; i <= slabs.size(); ++i) {
    if (is_cubic && i < slabs.size()) {
      solve(1, slabs[i]);
      solve(2, slabs[i]);
    }
    if (i > 0) finish_bricks(field, slabs[i - 1], result, strongest);
  }
  return strongest;
}

std::optional<double> place_values(const TensorBlock& block, int components, float* values) {
  return components == TensorBrick::symmetric ? place<TensorBrick::symmetric>(block, values)
                                              : place<TensorBrick::general>(block, values);
}

void continue_values(const Coefficients& field) {
  if (field.interpolant.between == Interpolation::linear && field.interpolant.border == Border::fade) return;
  // Each sweep leads one voxel further; those beside edges and corners are reached along one axis after the other. A
  // sweep reads only voxels that were known before it.
  std::vector<VoxelMask> known = field.bricks.active, next = known;
  for (std::atomic<bool> changed{true}; changed;) {
    changed = false;
    tbb::parallel_for(std::size_t{0}, field.bricks.places.size(), [&](std::size_t i) {
      if (known[i] == field.bricks.filled[i]) return;
      next[i] = continue_block(i, field, known);
      if (next[i] != known[i]) changed = true;
    });
    known = next;
  }
}

}  // namespace tensorray
