#include "volumes/sampling/sample_tensors.h"

#include <algorithm>

#include "volumes/bricks/brick_layout.h"
#include "volumes/sampling/tensor_sampler.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volumes/sampling/sample_tensors.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/highway.h>

#ifndef TENSORRAY_VOLUMES_SAMPLE_TENSORS
#define TENSORRAY_VOLUMES_SAMPLE_TENSORS
namespace tensorray {
namespace {

constexpr std::size_t cell_block = 64;  // Number of points that are sampled together; a multiple of all vectors.

/// The cells of some points.
struct Cells {
  std::size_t count = 0;                                    // Of the points.
  alignas(64) float fraction[3][cell_block] = {};           // Position within the cell.
  alignas(64) std::int32_t brick[3][cell_block] = {};       // Coordinates of the brick.
  alignas(64) std::int32_t voxel[cell_block] = {};          // Number, in the brick, of the cell's first coefficient.
  const float *bending[cell_block], *trailing[cell_block];  // Of the brick.
};

/// The extent, from the points' origin: its first and last voxels, and the first voxel of its last cell.
struct CellRange {
  float first[3], last[3], last_cell[3];
  std::int32_t origin[3];
};

}  // namespace
}  // namespace tensorray
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Eight = hn::CappedTag<float, 8>;  // For the components of one voxel.

/// Finds the cells of the points from `first` on.
void find_cells(const CellRange& range, const IndexPoints& points, std::size_t first, Cells& cells) {
  const Floats d;
  const hn::RebindToSigned<Floats> ints;
  for (std::size_t p = 0; p < cells.count; p += hn::Lanes(d)) {
    auto voxel = hn::Zero(ints);
    for (int axis = 0; axis < 3; ++axis) {
      const auto position = hn::LoadU(d, points.position[axis] + first + p);
      // In this order a NaN becomes the first voxel.
      const auto at = hn::Min(hn::Max(position, hn::Set(d, range.first[axis])), hn::Set(d, range.last[axis]));
      const auto cell = hn::Min(hn::Floor(at), hn::Set(d, range.last_cell[axis]));
      hn::Store(hn::Sub(at, cell), d, cells.fraction[axis] + p);
      const auto index = hn::Add(hn::ConvertTo(ints, cell), hn::Set(ints, range.origin[axis]));
      hn::Store(hn::ShiftRight<3>(index), ints, cells.brick[axis] + p);
      const auto within = hn::And(index, hn::Set(ints, TensorBrick::cells - 1));
      voxel = hn::Add(hn::Mul(voxel, hn::Set(ints, CubicBrick::width)), within);
    }
    hn::Store(voxel, ints, cells.voxel + p);
  }
}

/// Stores components c and following of point p: the first four of all points, then the other four.
template <class V>
HWY_INLINE void store_components(V values, std::size_t c, std::size_t p, float (*components)[4 * cell_block]) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (hn::MaxLanes(Eight()) == 8) {
    const hn::Half<hn::DFromV<V>> four;
    hn::Store(hn::LowerHalf(four, values), four, components[0] + 4 * p);
    return hn::Store(hn::UpperHalf(four, values), four, components[1] + 4 * p);
  }
#endif
  hn::Store(values, hn::DFromV<V>(), components[c / 4] + 4 * p + c % 4);
}

/// The weights of the cubic B-spline along an axis (as in tensor_sampler.cpp).
HWY_INLINE void spline_weights(float t, float (&weights)[4]) {
  const float u = 1 - t;
  weights[0] = u * u * u / 6;
  weights[1] = 2.0f / 3 - t * t * (2 - t) / 2;
  weights[2] = 2.0f / 3 - u * u * (2 - u) / 2;
  weights[3] = t * t * t / 6;
}

/// The stored components of T − T₂₂ I, and T₂₂.
template <int stored>
void sample_spline(const Cells& cells, float (*components)[4 * cell_block], float* trailing) {
  const Eight d;
  constexpr int width = CubicBrick::width;
  for (std::size_t p = 0; p < cells.count; ++p) {
    float x[4], y[4], z[4];
    spline_weights(cells.fraction[0][p], x);
    spline_weights(cells.fraction[1][p], y);
    spline_weights(cells.fraction[2][p], z);
    const float* const first = cells.bending[p] + static_cast<std::size_t>(cells.voxel[p]) * stored;
    for (std::size_t c = 0; c < stored; c += hn::Lanes(d)) {
      auto sum = hn::Zero(d);
      for (std::size_t row = 0; row < 16; ++row) {
        const float* const along = first + (row / 4 * width + row % 4) * width * stored + c;
        auto line = hn::Mul(hn::Set(d, z[0]), hn::LoadU(d, along));
        for (std::size_t k = 1; k < 4; ++k) line = hn::MulAdd(hn::Set(d, z[k]), hn::LoadU(d, along + k * stored), line);
        sum = hn::MulAdd(hn::Set(d, x[row / 4] * y[row % 4]), line, sum);
      }
      store_components(sum, c, p, components);
    }
    const float* const last = cells.trailing[p] + cells.voxel[p];
    float sum = 0;
    for (std::size_t row = 0; row < 16; ++row) {
      const float* const along = last + (row / 4 * width + row % 4) * width;
      sum += x[row / 4] * y[row % 4] * (z[0] * along[0] + z[1] * along[1] + z[2] * along[2] + z[3] * along[3]);
    }
    trailing[p] = sum;
  }
}

/// Samples the cells. @param components, stride  As in sample_tensors.
template <int stored>
void sample_cells_of(const Cells& cells, float factor, float* components, std::size_t stride) {
  const Floats d;
  alignas(64) float bending[2][4 * cell_block], trailing[cell_block];
  sample_spline<stored>(cells, bending, trailing);
  for (std::size_t p = 0; p < cells.count; p += hn::Lanes(d)) {
    hn::Vec<Floats> s[8], T[9];
    hn::LoadInterleaved4(d, bending[0] + 4 * p, s[0], s[1], s[2], s[3]);
    hn::LoadInterleaved4(d, bending[1] + 4 * p, s[4], s[5], s[6], s[7]);
    for (int i = 0; i < 8; ++i) T[i] = s[TensorBrick::stored_component(stored, i)];
    T[8] = hn::Load(d, trailing + p);
    T[0] = hn::Add(T[0], T[8]);
    T[4] = hn::Add(T[4], T[8]);
    for (std::size_t c = 0; c < 9; ++c) hn::StoreU(hn::Mul(T[c], hn::Set(d, factor)), d, components + c * stride + p);
  }
}

void sample_cells(const Cells& cells, int stored, float factor, float* components, std::size_t stride) {
  if (stored == TensorBrick::symmetric)
    sample_cells_of<TensorBrick::symmetric>(cells, factor, components, stride);
  else
    sample_cells_of<TensorBrick::general>(cells, factor, components, stride);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace tensorray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(find_cells);
HWY_EXPORT(sample_cells);

namespace {

CellRange cell_range(const TensorField& field, const Eigen::Vector3i& origin) {
  CellRange range;
  for (int axis = 0; axis < 3; ++axis) {
    const double first = field.voxels().min()[axis], last = field.voxels().max()[axis];
    range.first[axis] = static_cast<float>(first - origin[axis]);
    range.last[axis] = static_cast<float>(last - origin[axis]);
    range.last_cell[axis] = static_cast<float>(std::max(first, last - 1) - origin[axis]);
    range.origin[axis] = origin[axis];
  }
  return range;
}

/// Finds the voxels of the cells. @param at, brick  The brick that was found last, and its coordinates.
void find_voxels(const TensorField& field, Eigen::Vector3i& at, TensorBrick& brick, Cells& cells) {
  for (std::size_t p = 0; p < cells.count; ++p) {
    const Eigen::Vector3i wanted(cells.brick[0][p], cells.brick[1][p], cells.brick[2][p]);
    if (wanted != at) {
      at = wanted;
      brick = field.brick(at);
    }
    cells.bending[p] = brick.bending;
    cells.trailing[p] = brick.trailing;
  }
}

}  // namespace

namespace {

/// In a linear field: one by one.
void sample_linear(const TensorField& field, const IndexPoints& points, float factor, float* components,
                   std::size_t stride) {
  TensorSampler sampler(field);
  const Eigen::Vector3d origin = (TensorBrick::cells * points.brick).cast<double>();
  for (std::size_t p = 0; p < points.count; ++p) {
    const Eigen::Vector3d from(points.position[0][p], points.position[1][p], points.position[2][p]);
    const Eigen::Matrix3f T = factor * sampler.at(field.to_world() * (origin + from)).cast<float>();
    for (std::size_t c = 0; c < 9; ++c) components[c * stride + p] = T.data()[c];
  }
}

}  // namespace

void sample_tensors(const TensorField& field, const IndexPoints& points, float factor, float* components,
                    std::size_t stride) {
  if (!field.is_cubic()) return sample_linear(field, points, factor, components, stride);
  const CellRange range = cell_range(field, TensorBrick::cells * points.brick);
  Cells cells;
  Eigen::Vector3i at = Eigen::Vector3i::Constant(INT32_MIN);
  TensorBrick brick{};
  for (std::size_t first = 0; first < points.count; first += cell_block) {
    cells.count = std::min(cell_block, points.count - first);
    HWY_DYNAMIC_DISPATCH(find_cells)(range, points, first, cells);
    find_voxels(field, at, brick, cells);
    HWY_DYNAMIC_DISPATCH(sample_cells)
    (cells, brick.components, factor, components + first, stride);
  }
}

}  // namespace tensorray
#endif
