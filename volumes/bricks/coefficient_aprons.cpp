// `finish_bricks` of coefficients.h.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include <tbb/parallel_for.h>

#include "volumes/bricks/coefficients.h"
#include "volumes/bricks/finer_bricks.h"

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;

StoredTensor beyond(const Coefficients& field, Vector3i index, int axis, int face, int inward);

/// The coefficient at any index.
StoredTensor coefficient_at(const Coefficients& field, const Vector3i& index) {
  for (int axis = 0; axis < 3; ++axis) {
    const int low = field.extent.min()[axis], high = field.extent.max()[axis];
    if (index[axis] >= low && index[axis] <= high) continue;
    return beyond(field, index, axis, index[axis] < low ? low : high, index[axis] < low ? 1 : -1);
  }
  const auto voxel = find_voxel(field.bricks, field.bricks.filled, index);
  return voxel ? read_coefficient(field.blocks, *voxel) : StoredTensor(StoredTensor::Zero());
}

/// One voxel beyond a face of the extent: the polynomial that `solve_run` takes coefficients for.
StoredTensor beyond(const Coefficients& field, Vector3i index, int axis, int face, int inward) {
  constexpr float weights[5][4] = {{}, {1}, {2, -1}, {3, -3, 1}, {4, -6, 4, -1}};
  const AlignedBox3i& extent = field.extent;
  const int size = extent.max()[axis] - extent.min()[axis] + 1;
  int run = 0;
  Vector3i along = index.cwiseMax(extent.min()).cwiseMin(extent.max());
  for (; run < 4; ++run) {
    along[axis] = face + run * inward;
    if (!find_voxel(field.bricks, field.bricks.filled, along)) break;
  }
  const bool extends = field.interpolant.border == Border::extend && is_free(field.bricks, along);
  const bool is_parabola = run == 3 && (size == 3 || extends);  // Both ends of the run continue.
  const int terms = size == 1 ? 1 : run < 3 ? 2 : is_parabola ? 3 : 4;
  StoredTensor sum = StoredTensor::Zero();
  for (int i = 0; i < terms; ++i) {
    index[axis] = face + i * inward;
    sum += weights[terms][i] * coefficient_at(field, index);
  }
  return sum;
}

/// Calls visit(neighbour, first, end) for the parts of a brick: the block that it belongs to, and the range of its
/// voxels in the brick.
template <class Brick, class Visit>
void for_parts(const Visit& visit) {
  const auto first = [](int o) { return o < 0 ? -Brick::before : TensorBlock::size * o; };
  const auto size = [](int o) { return o < 0 ? Brick::before : o == 0 ? TensorBlock::size : Brick::behind; };
  for (int n = 0; n < neighbour_count; ++n) {
    const Vector3i offset = neighbour(n);
    const Vector3i from(first(offset.x()), first(offset.y()), first(offset.z()));
    visit(offset, from, from + Vector3i(size(offset.x()), size(offset.y()), size(offset.z())));
  }
}

/// Copies a part of a brick, `length` voxels along z, from the block that it belongs to.
template <class Brick, int components, int length>
void copy_part_of(const float* block, const Vector3i& offset, const Vector3i& first, const Vector3i& end,
                  float* brick) {
  const Vector3i origin = TensorBlock::size * offset;
  for (int x = first.x(); x < end.x(); ++x)
    for (int y = first.y(); y < end.y(); ++y) {
      const int to = Brick::coefficient(x, y, first.z());
      const int from = CoefficientBlock::coefficient(x - origin.x(), y - origin.y(), first.z() - origin.z());
      std::memcpy(brick + Brick::bending_offset(components, to),
                  block + CoefficientBlock::bending_offset(components, from), length * components * sizeof(float));
      std::memcpy(brick + Brick::trailing_offset(components) + to,
                  block + CoefficientBlock::trailing_offset(components) + from, length * sizeof(float));
    }
}

template <class Brick, int components>
void copy_part(const float* block, const Vector3i& offset, const Vector3i& first, const Vector3i& end, float* brick) {
  if (offset.z() == 0)
    copy_part_of<Brick, components, TensorBlock::size>(block, offset, first, end, brick);
  else if (offset.z() > 0)
    copy_part_of<Brick, components, Brick::behind>(block, offset, first, end, brick);
  else if constexpr (Brick::before > 0)
    copy_part_of<Brick, components, Brick::before>(block, offset, first, end, brick);
}

/// Extrapolates the coefficients of a brick that are outside the extent.
void extrapolate(const Coefficients& field, const Vector3i& place, float* brick) {
  const Vector3i origin = TensorBlock::size * place;
  const auto is_beyond = [&](int axis, int i) {
    return origin[axis] + i == field.extent.min()[axis] - 1 || origin[axis] + i == field.extent.max()[axis] + 1;
  };
  const auto is_far = [&](int axis, int i) {
    return origin[axis] + i < field.extent.min()[axis] - 1 || origin[axis] + i > field.extent.max()[axis] + 1;
  };
  for (int x = -1; x < CubicBrick::width - 1; ++x)
    for (int y = -1; y < CubicBrick::width - 1; ++y)
      for (int z = -1; z < CubicBrick::width - 1; ++z) {
        if (is_far(0, x) || is_far(1, y) || is_far(2, z)) continue;  // No cell of the extent needs it.
        if (is_beyond(0, x) || is_beyond(1, y) || is_beyond(2, z))
          write_coefficient<CubicBrick>(coefficient_at(field, origin + Vector3i(x, y, z)), field.blocks.components,
                                        brick, CubicBrick::coefficient(x, y, z));
      }
}

/// The greatest squared Frobenius norm of the deviators of tensors, from T − T₂₂ I. NaN counts as zero.
template <class Number>
struct Deviators {
  Number greatest = 0, squares = 0;  ///< Of a deviator, and of T − T₂₂ I.

  /// @param stored  The stored components of T − T₂₂ I.
  template <int components>
  void add(const float* stored) {
    const auto component = [&](int k) { return Number(stored[TensorBrick::stored_component(components, k)]); };
    Number sum = 0;
    for (int k = 0; k < TensorBrick::general; ++k) sum += component(k) * component(k);
    const Number trace = component(0) + component(4);
    squares = std::max(squares, sum);
    greatest = std::max(greatest, sum - trace * trace / 3);
  }

  /// Whether no square underflows or overflows, nearly. In single precision the error is then below 2e-6, because the
  /// trace takes at most two thirds of the squares away.
  bool are_exact() const { return greatest > Number(min_square) && squares < Number(max_square); }

  /// Rounded up, because interpolation may round to slightly more than the tensor of any voxel.
  float bound() const { return static_cast<float>(std::sqrt(double{greatest}) * (1 + 1.2e-5)); }
};

/// TensorBrick::strongest: what is between voxels is a mean of coefficients, so that none of its deviators is greater
/// than theirs.
template <class Brick, int components>
float strongest_of(const float* brick) {
  Deviators<float> single;
  for (int i = 0; i < Brick::coefficients; ++i) single.add<components>(brick + Brick::bending_offset(components, i));
  if (single.are_exact()) return single.bound();
  Deviators<double> exact;
  for (int i = 0; i < Brick::coefficients; ++i) exact.add<components>(brick + Brick::bending_offset(components, i));
  return exact.bound();
}

/// @return TensorBrick::strongest.
template <class Brick, int components>
float finish_brick(const Coefficients& field, const Vector3i& place, float* brick) {
  for_parts<Brick>([&](const Vector3i& offset, const Vector3i& first, const Vector3i& end) {
    const std::uint32_t block = field.bricks.index.find(place + offset);
    if (block != BrickIndex::missing)
      copy_part<Brick, components>(field.blocks.brick(block), offset, first, end, brick);
  });
  const AlignedBox3i covered(TensorBlock::size * place - Vector3i::Ones(),
                             TensorBlock::size * place + Vector3i::Constant(TensorBlock::size + 1));
  if (std::is_same_v<Brick, CubicBrick> && !field.extent.contains(covered)) extrapolate(field, place, brick);
  if (std::is_same_v<Brick, CubicBrick> && field.coarser)
    add_coarser(*field.coarser, place, field.blocks.components, brick);
  return strongest_of<Brick, components>(brick);
}

template <class Brick>
float finish_brick(const Coefficients& field, const Vector3i& place, float* brick) {
  return field.blocks.components == TensorBrick::symmetric
             ? finish_brick<Brick, TensorBrick::symmetric>(field, place, brick)
             : finish_brick<Brick, TensorBrick::general>(field, place, brick);
}

}  // namespace

void finish_bricks(const Coefficients& field, const PlaceNumbers& numbers, const BrickMemory& result,
                   std::vector<float>& strongest) {
  tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t n) {
    const std::uint32_t i = numbers[n];
    if (i >= field.bricks.count) return;
    const Vector3i& place = field.bricks.places[i];
    std::fill_n(result.brick(i), result.stride, 0.0f);  // It may have held blocks.
    strongest[i] = field.interpolant.between == Interpolation::linear
                       ? finish_brick<LinearBrick>(field, place, result.brick(i))
                       : finish_brick<CubicBrick>(field, place, result.brick(i));
  });
}

}  // namespace tensorray
