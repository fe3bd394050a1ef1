#include "volumes/bricks/finer_bricks.h"

#include <algorithm>
#include <cstdint>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::AlignedBox3i;
using Eigen::Vector3i;

Vector3i parent_of(const Vector3i& place) {
  return place.unaryExpr([](int v) { return v >> 1; });
}

/// What a number along an axis is made of: four coefficients of the coarser brick, from `first` on.
struct Taps {
  int first;
  float weights[4];
};

/// Along an axis, the first `count` numbers of a half of a coarser brick, the first of which is at `begin`, in finer
/// voxels from the half's first one. Half 2 is the voxel behind the brick.
struct Resampling {
  static constexpr int most = CubicBrick::width;

  int count;
  Taps taps[3][most];

  /// @param even, odd  The weights of c[i − 1], c[i], … at the finer voxels 2i and 2i + 1.
  Resampling(int begin, int numbers, const float (&even)[4], const float (&odd)[4]) : count(numbers) {
    for (int half = 0; half < 3; ++half)
      for (int n = 0; n < count; ++n) {
        const int fine = TensorBlock::size * half + begin + n, coarse = fine >> 1;
        const int last = CubicBrick::cells + CubicBrick::behind - 4;
        Taps& taps_of_n = taps[half][n] = {std::clamp(coarse - 1, -CubicBrick::before, last), {}};
        for (int k = 0; k < 4; ++k) {
          const int at = coarse - 1 + k - taps_of_n.first;
          if (at >= 0 && at < 4) taps_of_n.weights[at] = (fine & 1) != 0 ? odd[k] : even[k];
        }
      }
  }
};

const Resampling& to_coefficients() {
  static const Resampling resampling(-CubicBrick::before, CubicBrick::width, {1 / 8.0f, 6 / 8.0f, 1 / 8.0f, 0},
                                     {0, 0.5f, 0.5f, 0});
  return resampling;
}

const Resampling& to_values() {
  static const Resampling resampling(0, TensorBlock::size, {1 / 6.0f, 4 / 6.0f, 1 / 6.0f, 0},
                                     {1 / 48.0f, 23 / 48.0f, 23 / 48.0f, 1 / 48.0f});
  return resampling;
}

/// to[i] = Σ weights[k] from[k · stride + i].
template <int length>
void blend(const float* from, std::ptrdiff_t stride, const float (&weights)[4], float* to) {
  for (int i = 0; i < length; ++i)
    to[i] = weights[0] * from[i] + weights[1] * from[stride + i] + weights[2] * from[2 * stride + i] +
            weights[3] * from[3 * stride + i];
}

/// Numbers of a part of a brick, axis after axis. Calls write(x, y, z, numbers).
/// @param numbers  Of the coarser brick, `width` a coefficient. @param part  The half along each axis.
template <int width, class Write>
void resample(const Resampling& resampling, const float* numbers, const Vector3i& part, const Write& write) {
  constexpr int most = Resampling::most, row = CubicBrick::width * width;
  const int count = resampling.count;
  const auto taps = [&](int axis, int n) -> const Taps& { return resampling.taps[part[axis]][n]; };
  float by_x[most][row], by_y[row], by_z[width];  // A plane across x, a line along z, a number.
  for (int x = 0; x < count; ++x) {
    const Taps& along_x = taps(0, x);
    for (int y = taps(1, 0).first; y < taps(1, count - 1).first + 4; ++y)
      blend<row>(numbers + std::ptrdiff_t{CubicBrick::coefficient(along_x.first, y, -CubicBrick::before)} * width,
                 std::ptrdiff_t{CubicBrick::width} * row, along_x.weights, by_x[y + CubicBrick::before]);
    for (int y = 0; y < count; ++y) {
      const Taps& along_y = taps(1, y);
      blend<row>(by_x[along_y.first + CubicBrick::before], row, along_y.weights, by_y);
      for (int z = 0; z < count; ++z) {
        const Taps& along_z = taps(2, z);
        blend<width>(by_y + (along_z.first + CubicBrick::before) * width, width, along_z.weights, by_z);
        write(x, y, z, static_cast<const float*>(by_z));
      }
    }
  }
}

template <int components>
void subtract(const Coefficients& field, std::size_t i, const float* coarse, const Vector3i& part, float* block) {
  const VoxelMask& active = field.bricks.active[i];
  const auto subtract_at = [&](int x, int y, int z, const float* numbers, int count, float* from) {
    for (int k = 0; k < count; ++k) from[k] = is_set(active, x, y, z) ? from[k] - numbers[k] : 0.0f;
  };
  resample<components>(to_values(), coarse, part, [&](int x, int y, int z, const float* numbers) {
    const int at = CoefficientBlock::bending_offset(components, CoefficientBlock::coefficient(x, y, z));
    subtract_at(x, y, z, numbers, components, block + at);
  });
  resample<1>(to_values(), coarse + CubicBrick::trailing_offset(components), part,
              [&](int x, int y, int z, const float* number) {
                const int at = CoefficientBlock::coefficient(x, y, z);
                subtract_at(x, y, z, number, 1, block + CoefficientBlock::trailing_offset(components) + at);
              });
}

template <int components>
void add(const float* coarse, const Vector3i& part, float* brick) {
  resample<components>(to_coefficients(), coarse, part, [&](int x, int y, int z, const float* numbers) {
    const int number = (x * CubicBrick::width + y) * CubicBrick::width + z;
    for (int k = 0; k < components; ++k) brick[number * components + k] += numbers[k];
  });
  float* const trailing = brick + CubicBrick::trailing_offset(components);
  resample<1>(to_coefficients(), coarse + CubicBrick::trailing_offset(components), part,
              [&](int x, int y, int z, const float* number) {
                trailing[(x * CubicBrick::width + y) * CubicBrick::width + z] += *number;
              });
}

/// The voxels of a place that are free. Each voxel is near at most one neighbour of the refined brick along each axis.
VoxelMask free_voxels(const Vector3i& place, const BrickIndex& refined, const AlignedBox3i& coarse_cells) {
  const Vector3i parent = parent_of(place), half = place - 2 * parent;
  bool is_open[8], all_open[8];  // Of the neighbours along axes 1, 2 and 4.
  for (int n = 0; n < 8; ++n) {
    Vector3i at = parent;
    for (int axis = 0; axis < 3; ++axis)
      if ((n >> axis & 1) != 0) at[axis] += half[axis] == 0 ? -1 : 1;
    is_open[n] = refined.find(at) != BrickIndex::missing || !coarse_cells.contains(at);
    all_open[n] = true;
    for (int part = 0; part <= n; ++part)
      if ((part & n) == part) all_open[n] = all_open[n] && is_open[part];
  }
  // A B-spline reaches from two voxels before its own to two behind.
  const auto is_near = [&](int axis, int i) { return half[axis] == 0 ? i < 2 : i == TensorBlock::size - 1; };
  VoxelMask mask{};
  for (int x = 0; x < TensorBlock::size; ++x)
    for (int y = 0; y < TensorBlock::size; ++y)
      for (int z = 0; z < TensorBlock::size; ++z)
        if (all_open[(is_near(0, x) ? 1 : 0) + (is_near(1, y) ? 2 : 0) + (is_near(2, z) ? 4 : 0)])
          mask[static_cast<std::size_t>(x * TensorBlock::size + y)] |= static_cast<std::uint8_t>(1u << z);
  return mask;
}

void intersect(VoxelMask& mask, const VoxelMask& other) {
  for (std::size_t row = 0; row < mask.size(); ++row) mask[row] = static_cast<std::uint8_t>(mask[row] & other[row]);
}

}  // namespace

AlignedBox3i finer_extent(const AlignedBox3i& extent) { return {2 * extent.min(), 2 * extent.max()}; }

std::vector<Vector3i> refined_bricks(const std::vector<BlockShape>& shapes, const AlignedBox3i& extent,
                                     const BrickIndex* existing) {
  const AlignedBox3i with_cells = bricks_with_cells(extent), voxels = finer_extent(extent);
  std::vector<Vector3i> refined;
  for (const BlockShape& shape : shapes) {
    const Vector3i brick = parent_of(shape.origin / TensorBlock::size);
    if (!with_cells.contains(brick) || (existing && existing->find(brick) == BrickIndex::missing)) continue;
    if (!active_box({shape}).intersection(voxels).isEmpty()) refined.push_back(brick);
  }
  sort_places(refined);
  return refined;
}

CoefficientBricks finer_bricks(const BlockTable& table, const std::vector<Vector3i>& refined,
                               const AlignedBox3i& extent, const Interpolant& interpolant) {
  const BrickIndex index(refined);
  std::vector<Vector3i> candidates;
  for (const BlockShape& shape : shapes_within(refined, extent)) candidates.push_back(shape.origin / TensorBlock::size);
  const auto is_brick = [&](const Vector3i& place) { return index.find(parent_of(place)) != BrickIndex::missing; };
  CoefficientBricks result;
  result.places = candidates;
  std::stable_partition(result.places.begin(), result.places.end(), is_brick);
  result.count = static_cast<std::size_t>(std::count_if(candidates.begin(), candidates.end(), is_brick));
  result.index = BrickIndex(result.places);
  make_slabs(result);

  const std::size_t count = result.places.size();
  const AlignedBox3i coarse_cells = bricks_with_cells({parent_of(extent.min()), parent_of(extent.max())});
  const std::vector<VoxelMask> none(count);
  result.free = result.active = none;
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const Vector3i& place = result.places[i];
    result.free[i] = free_voxels(place, index, coarse_cells);
    cut(result.free[i], place, extent);
    const std::uint32_t block = table.index.find(place);
    if (block == BrickIndex::missing) return;
    result.active[i] = mask_of(table.shapes[block]);
    intersect(result.active[i], result.free[i]);
  });
  result.filled = filled_voxels(result.places, result.index, result.active, extent, interpolant);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { intersect(result.filled[i], result.free[i]); });
  return result;
}

void subtract_coarser(const Coefficients& field, std::size_t i, float* block) {
  const Vector3i& place = field.bricks.places[i];
  Vector3i parent = parent_of(place), part = place - 2 * parent;
  for (int axis = 0; axis < 3; ++axis) {
    const int first = TensorBlock::size * place[axis];
    if (part[axis] != 0 || first != field.extent.max()[axis] || first == field.extent.min()[axis]) continue;
    --parent[axis];  // The voxel is on its face.
    part[axis] = 2;
  }
  const std::uint32_t at = field.coarser->index.find(parent);
  const int components = field.blocks.components;
  if (at == BrickIndex::missing || !any_of(field.bricks.active[i]))
    std::fill_n(block, field.blocks.stride, 0.0f);
  else if (components == TensorBrick::symmetric)
    subtract<TensorBrick::symmetric>(field, i, field.coarser->memory.brick(at), part, block);
  else
    subtract<TensorBrick::general>(field, i, field.coarser->memory.brick(at), part, block);
}

void add_coarser(const CoarserLevel& coarser, const Vector3i& place, int components, float* brick) {
  const Vector3i parent = parent_of(place), part = place - 2 * parent;
  const float* const from = coarser.memory.brick(coarser.index.find(parent));
  components == TensorBrick::symmetric ? add<TensorBrick::symmetric>(from, part, brick)
                                       : add<TensorBrick::general>(from, part, brick);
}

}  // namespace tensorray
