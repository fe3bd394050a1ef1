#include "volumes/bricks/brick_making.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstring>
#include <optional>
#include <tuple>

#include <tbb/parallel_sort.h>

#include "volumes/bricks/cubic_brick.h"
#include "volumes/grids/four_floats.h"

namespace tensorray {
namespace {

constexpr int cells = TensorBrick::cells;
static_assert(cells == TensorBlock::size, "a brick holds a block and the near faces of its neighbours");

/// The preceding bricks whose aprons contain an active voxel of `block`. Bit i is the brick at the place of the
/// block minus corner(i).
std::bitset<8> shared_faces(const BlockShape& block) {
  std::bitset<8> touched;
  if (block.active.all()) return touched.set();
  for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
    if (!block.active[offset]) continue;
    const Eigen::Vector3i p = TensorBlock::position(offset);
    const int faces = (p.x() == 0) | (p.y() == 0) << 1 | (p.z() == 0) << 2;
    for (int before = 0; before < 8; ++before)
      if ((before & faces) == before) touched.set(before);
  }
  return touched;
}

/// The voxels of a block as bricks hold them.
struct BlockVoxels {
  alignas(64) float bending[TensorBlock::voxels * TensorBrick::general];
  alignas(64) float trailing[TensorBlock::voxels];
  alignas(64) float deviator[TensorBlock::voxels];  // Squared norm.
  alignas(64) float squares[TensorBlock::voxels];   // Sum of the squares of `bending`.
};

Four square(const Four& x) { return x * x; }

/// Some components of four voxels: each first a vector of a voxel, then a vector of a component.
struct FourVoxels {
  Four v[4];

  void transpose() {
    const Four a = low_pairs(v[0], v[1]), b = low_pairs(v[2], v[3]);
    const Four c = high_pairs(v[0], v[1]), d = high_pairs(v[2], v[3]);
    v[0] = low_halves(a, b);
    v[1] = high_halves(a, b);
    v[2] = low_halves(c, d);
    v[3] = high_halves(c, d);
  }
};

/// What `convert` finds.
struct Conversion {
  float norm;         // Greatest squared norm of T.
  bool is_symmetric;  // Whether T = Tᵀ in all voxels, bit for bit.
};

/// The stored components of T − T₂₂ I, and T₂₂, of each voxel.
template <int components>
Conversion convert(const TensorBlock& block, BlockVoxels& voxels) {
  constexpr FourBits first_one{~0u}, first_two{~0u, ~0u};
  Four greatest{};
  FourBits asymmetry{}, corner_asymmetry{};
  for (int i = 0; i < TensorBlock::voxels; i += 4) {
    FourVoxels squares, diagonal;
    for (int k = 0; k < 4; ++k) {
      const float* const T = block.values[i + k].data();
      float* const bending = voxels.bending + (i + k) * components;
      const Four begin = read_four(T), end = read_four(T + 4), last{T[8], T[8], T[8], T[8]};
      const Four low = low_pairs(begin, end), high = high_pairs(begin, end);
      asymmetry |= difference(low, high);          // In the upper half.
      corner_asymmetry |= difference(begin, end);  // In the third number.
      const Four second = end - kept(last, first_one);
      write_four(begin - kept(last, first_one), bending);
      if constexpr (components == TensorBrick::symmetric)
        write_four(kept(second, first_two), bending + 3);  // The next voxel follows.
      else
        write_four(second, bending + 4);
      squares.v[k] = square(begin) + square(end);
      diagonal.v[k] = low - kept(last, first_two);
    }
    squares.transpose();
    diagonal.transpose();
    const Four last{block.values[i].data()[8], block.values[i + 1].data()[8], block.values[i + 2].data()[8],
                    block.values[i + 3].data()[8]};
    const Four even = squares.v[2], odd = squares.v[1] + squares.v[3];
    const Four norm = ((squares.v[0] + even) + odd) + square(last);
    const Four sum = ((square(diagonal.v[0]) + square(diagonal.v[1])) + even) + odd;
    greatest = greatest < norm ? norm : greatest;
    // The relative error of single precision is below 2e-6 here, because the trace takes at most two thirds of the
    // squares away.
    write_four(sum - square(diagonal.v[0] + diagonal.v[1]) * (1.0f / 3), voxels.deviator + i);
    write_four(sum, voxels.squares + i);
    write_four(last, voxels.trailing + i);
  }
  return {std::max(std::max(greatest[0], greatest[1]), std::max(greatest[2], greatest[3])),
          (asymmetry[2] | asymmetry[3] | corner_asymmetry[2]) == 0};
}

/// In double precision, for values of any size; NaN counts as zero.
double greatest_squared_norm(const TensorBlock& block) {
  double greatest = 0;
  for (const Eigen::Matrix3f& value : block.values) greatest = std::max(greatest, value.cast<double>().squaredNorm());
  return greatest;
}

/// @param norm  The greatest squared norm of a block's tensors in single precision.
double squared_norm(float norm, const TensorBlock& block) {
  return norm > least_square && norm < greatest_square ? double{norm} : greatest_squared_norm(block);
}

/// Calls visit(offset, voxel) for the voxels that a block and a brick share: the offset of a row's first voxel in the
/// block, and its number in the brick. Rows along z are of eight voxels, or of one.
/// @param ahead  Offset of the block from the brick, 0 or 1 along each axis.
template <class Visit>
void for_shared_rows(const Eigen::Vector3i& ahead, const Visit& visit) {
  const auto count = [&](int axis) { return ahead[axis] == 0 ? cells : 1; };
  const Eigen::Vector3i first = ahead * cells;
  for (int x = 0; x < count(0); ++x)
    for (int y = 0; y < count(1); ++y)
      visit(TensorBlock::offset(x, y, 0), TensorBrick::voxel(x + first.x(), y + first.y(), first.z()));
}

/// Copies `length` voxels.
template <int components, int length>
void copy_row(const BlockVoxels& voxels, int from, float* brick, int to) {
  std::memcpy(brick + TensorBrick::bending_offset(components, to), voxels.bending + from * components,
              length * components * sizeof(float));
  std::memcpy(brick + TensorBrick::trailing_offset(components) + to, voxels.trailing + from, length * sizeof(float));
}

/// Sets what the brick that is corner(bits) before the block needs to know.
template <int length>
void set_share(const BlockVoxels& voxels, int bits, BlockShare& share) {
  float strongest = 0, squares = 0;
  for_shared_rows(corner(bits), [&](int from, int) {
    using Row = Eigen::Map<const Eigen::Array<float, length, 1>>;
    strongest = std::max(strongest, Row(voxels.deviator + from).maxCoeff());
    squares += Row(voxels.squares + from).sum();
  });
  share.strongest[static_cast<std::size_t>(bits)] = strongest;
  share.squares[static_cast<std::size_t>(bits)] = squares;
}

/// In double precision, for values of any size.
double greatest_squared_deviator(const TensorBrick& brick) {
  Deviators<double> deviators;
  for (int voxel = 0; voxel < TensorBrick::voxels; ++voxel) {
    const float* const stored = brick.bending + TensorBrick::bending_offset(brick.components, voxel);
    brick.components == TensorBrick::symmetric ? deviators.add<TensorBrick::symmetric>(stored)
                                               : deviators.add<TensorBrick::general>(stored);
  }
  return deviators.greatest;
}

template <int components>
std::optional<BlockShare> place(const TensorBlock& block, const std::array<float*, bricks_of_block>& bricks) {
  BlockVoxels voxels;
  BlockShare share;
  const auto [norm, is_symmetric] = convert<components>(block, voxels);
  if (components == TensorBrick::symmetric && !is_symmetric) return std::nullopt;
  share.norm = squared_norm(norm, block);
  for (int bits = 0; bits < bricks_of_block; ++bits) {
    const bool is_row = corner(bits).z() == 0;
    is_row ? set_share<cells>(voxels, bits, share) : set_share<1>(voxels, bits, share);
    float* const brick = bricks[static_cast<std::size_t>(bits)];
    if (!brick) continue;
    for_shared_rows(corner(bits), [&](int from, int to) {
      is_row ? copy_row<components, cells>(voxels, from, brick, to) : copy_row<components, 1>(voxels, from, brick, to);
    });
  }
  return share;
}

template <int components>
std::optional<double> place_own(const TensorBlock& block, float* values) {
  BlockVoxels voxels;
  const auto [norm, is_symmetric] = convert<components>(block, voxels);
  if (components == TensorBrick::symmetric && !is_symmetric) return std::nullopt;
  std::copy_n(voxels.bending, TensorBlock::voxels * components, values);
  std::memcpy(values + CoefficientBlock::trailing_offset(components), voxels.trailing, sizeof voxels.trailing);
  return squared_norm(norm, block);
}

}  // namespace

std::optional<double> place_values(const TensorBlock& block, int components, float* values) {
  return components == TensorBrick::symmetric ? place_own<TensorBrick::symmetric>(block, values)
                                              : place_own<TensorBrick::general>(block, values);
}

BlockTable::BlockTable(const std::vector<BlockShape>& all) : shapes(all) {
  places.reserve(shapes.size());
  for (const BlockShape& shape : shapes) places.emplace_back(shape.origin / cells);
  index = BrickIndex(places);
}

void sort_places(std::vector<Eigen::Vector3i>& places) {
  tbb::parallel_sort(places.begin(), places.end(), [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  });
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

Eigen::AlignedBox3i bricks_of(const Eigen::AlignedBox3i& voxels) {
  const auto brick_of = [](int cell) { return cell >> 3; };
  const Eigen::Vector3i last = (voxels.max().array() - 1).matrix().cwiseMax(voxels.min());
  return {voxels.min().unaryExpr(brick_of), last.unaryExpr(brick_of)};
}

std::vector<Eigen::Vector3i> active_bricks(const BlockTable& table, const Eigen::AlignedBox3i& extent) {
  std::vector<Eigen::Vector3i> bricks;
  bricks.reserve(table.places.size());
  for (std::size_t i = 0; i < table.places.size(); ++i) {
    if (extent.contains(table.places[i])) bricks.push_back(table.places[i]);
    for (int before = 1; before < bricks_of_block; ++before) {
      const Eigen::Vector3i brick = table.places[i] - corner(before);
      if (extent.contains(brick) && table.index.find(brick) == BrickIndex::missing &&
          shared_faces(table.shapes[i])[before])
        bricks.push_back(brick);
    }
  }
  sort_places(bricks);
  return bricks;
}

std::optional<BlockShare> place_block(const TensorBlock& block, int components,
                                      const std::array<float*, bricks_of_block>& bricks) {
  return components == TensorBrick::symmetric ? place<TensorBrick::symmetric>(block, bricks)
                                              : place<TensorBrick::general>(block, bricks);
}

void widen_brick(const float* symmetric, float* general) {
  constexpr int few = TensorBrick::symmetric, all = TensorBrick::general;
  for (int voxel = 0; voxel < TensorBrick::voxels; ++voxel)
    for (int i = 0; i < all; ++i)
      general[voxel * all + i] =
          symmetric[TensorBrick::bending_offset(few, voxel) + TensorBrick::stored_component(few, i)];
  std::copy_n(symmetric + TensorBrick::trailing_offset(few), TensorBrick::voxels,
              general + TensorBrick::trailing_offset(all));
}

float strongest_deviator(const BlockTable& table, const std::vector<BlockShare>& shares, const Eigen::Vector3i& place,
                         const TensorBrick& brick) {
  float greatest = 0, sum = 0;
  for (int bits = 0; bits < bricks_of_block; ++bits) {
    const std::uint32_t block = table.index.find(place + corner(bits));
    if (block == BrickIndex::missing) continue;
    greatest = std::max(greatest, shares[block].strongest[static_cast<std::size_t>(bits)]);
    sum += shares[block].squares[static_cast<std::size_t>(bits)];
  }
  const double squared =
      greatest > least_square && sum < greatest_square ? double{greatest} : greatest_squared_deviator(brick);
  return strongest_bound(squared);
}

}  // namespace tensorray
