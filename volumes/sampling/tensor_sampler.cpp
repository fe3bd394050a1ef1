#include "volumes/sampling/tensor_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "volumes/bricks/brick_layout.h"

namespace tensorray {

int TensorSampler::locate(const Eigen::Vector3d& world, Eigen::Vector3d& fraction) {
  const Eigen::AlignedBox3d& voxels = field_->voxels();
  const Eigen::Vector3d index = field_->to_index() * world;
  Eigen::Vector3i cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double first = voxels.min()[axis], last = voxels.max()[axis];
    const double inside = std::min(std::max(first, index[axis]), last);  // In this order NaN becomes the first voxel.
    const double near = std::max(std::min(std::floor(inside), last - 1), first);
    cell[axis] = static_cast<int>(near);
    fraction[axis] = inside - near;
  }
  const Eigen::Vector3i at(cell.x() >> 3, cell.y() >> 3, cell.z() >> 3);
  cell -= TensorBrick::cells * at;
  if (field_->levels() > 1) {
    find_leaf(at, cell, fraction);
  } else if (at != at_) {
    at_ = at;
    brick_ = field_->brick(at);
  }
  if (field_->is_cubic()) return CubicBrick::coefficient(cell.x() - 1, cell.y() - 1, cell.z() - 1);
  return LinearBrick::coefficient(cell.x(), cell.y(), cell.z());
}

void TensorSampler::find_leaf(const Eigen::Vector3i& at, Eigen::Vector3i& cell, Eigen::Vector3d& fraction) {
  const Eigen::Vector3d position = cell.cast<double>() + fraction;
  const Eigen::Array3d within = (position - first_).array();
  if (at != at_ || !((within >= 0).all() && (within < TensorBrick::cells / scale_).all())) {
    const LeafBrick leaf = field_->leaf(
        at, {static_cast<float>(position.x()), static_cast<float>(position.y()), static_cast<float>(position.z())});
    at_ = at;
    brick_ = leaf.brick;
    first_ = Eigen::Map<const Eigen::Vector3f>(leaf.first.data()).cast<double>();
    scale_ = leaf.scale;
    finest_ = std::max(finest_, scale_);
  }
  const Eigen::Vector3d local = (position - first_) * scale_;
  cell = local.cast<int>().cwiseMax(0).cwiseMin(TensorBrick::cells - 1);
  fraction = local - cell.cast<double>();
}

namespace {

/// A value, and its slopes along the axes of index space.
template <class Value>
struct Slopes {
  Value value, x, y, z;
};

/// The numbers of a brick that a point of a linear field depends on: the voxels of its cell, in all 2³.
struct LinearTaps : LinearBrick {
  static constexpr int taps = 2;
  static void find_weights(double t, double (&value)[2], double (&slope)[2]) {
    value[0] = 1 - t;
    value[1] = t;
    slope[0] = -1;
    slope[1] = 1;
  }
};

/// The same of a cubic field: 4³ coefficients.
struct CubicTaps : CubicBrick {
  static constexpr int taps = 4;
  static void find_weights(double t, double (&value)[4], double (&slope)[4]) {
    const double u = 1 - t;
    value[0] = u * u * u / 6;
    value[1] = 2.0 / 3 - t * t * (2 - t) / 2;
    value[2] = 2.0 / 3 - u * u * (2 - u) / 2;
    value[3] = t * t * t / 6;
    slope[0] = -u * u / 2;
    slope[1] = t * (3 * t - 4) / 2;
    slope[2] = -u * (3 * u - 4) / 2;
    slope[3] = t * t / 2;
  }
};

/// Weights of the numbers about a point along each axis.
template <class Taps>
struct Weights {
  double value[3][Taps::taps], slope[3][Taps::taps];

  explicit Weights(const Eigen::Vector3d& fraction) {
    for (int axis = 0; axis < 3; ++axis) Taps::find_weights(fraction[axis], value[axis], slope[axis]);
  }
};

/// to += weight · from
template <std::size_t count, class Number>
void add(double weight, const Number* from, std::array<double, count>& to) {
  for (std::size_t i = 0; i < count; ++i) to[i] += weight * from[i];
}

/// The interpolated numbers, and their slopes if they are wanted: sums along y, then x, then z.
/// @param first  `numbers` of the first tap; those along z follow each other.
template <class Taps, int numbers, bool slopes>
Slopes<std::array<double, numbers>> sums(const float* first, const Weights<Taps>& weights) {
  constexpr std::size_t row = Taps::taps * numbers;
  std::array<double, row> values{}, by_x{}, by_y{};
  for (int x = 0; x < Taps::taps; ++x) {
    std::array<double, row> lines{}, lines_by_y{};
    for (int y = 0; y < Taps::taps; ++y) {
      const float* const along = first + (x * Taps::width + y) * Taps::width * numbers;
      add(weights.value[1][y], along, lines);
      if constexpr (slopes) add(weights.slope[1][y], along, lines_by_y);
    }
    add(weights.value[0][x], lines.data(), values);
    if constexpr (slopes) {
      add(weights.slope[0][x], lines.data(), by_x);
      add(weights.value[0][x], lines_by_y.data(), by_y);
    }
  }
  Slopes<std::array<double, numbers>> result{};
  for (int z = 0; z < Taps::taps; ++z) {
    add(weights.value[2][z], &values[z * numbers], result.value);
    if constexpr (!slopes) continue;
    add(weights.value[2][z], &by_x[z * numbers], result.x);
    add(weights.value[2][z], &by_y[z * numbers], result.y);
    add(weights.slope[2][z], &values[z * numbers], result.z);
  }
  return result;
}

template <std::size_t components>
Eigen::Matrix3d to_matrix(const std::array<double, components>& bending, double trailing) {
  Eigen::Matrix3d T;
  for (int i = 0; i < 8; ++i) T.data()[i] = bending[TensorBrick::stored_component(components, i)];
  T(0, 0) += trailing;
  T(1, 1) += trailing;
  T(2, 2) = trailing;
  return T;
}

template <class Taps, int components, bool slopes>
Slopes<Eigen::Matrix3d> tensor_of(const TensorBrick& brick, int first, const Weights<Taps>& weights) {
  const auto bending = sums<Taps, components, slopes>(brick.bending + first * components, weights);
  const auto trailing = sums<Taps, 1, slopes>(brick.trailing + first, weights);
  Slopes<Eigen::Matrix3d> result;
  result.value = to_matrix(bending.value, trailing.value[0]);
  if constexpr (slopes) {
    result.x = to_matrix(bending.x, trailing.x[0]);
    result.y = to_matrix(bending.y, trailing.y[0]);
    result.z = to_matrix(bending.z, trailing.z[0]);
  }
  return result;
}

template <class Taps, bool slopes>
Slopes<Eigen::Matrix3d> tensor_in(const TensorBrick& brick, int first, const Eigen::Vector3d& fraction) {
  const Weights<Taps> weights(fraction);
  return brick.components == TensorBrick::symmetric
             ? tensor_of<Taps, TensorBrick::symmetric, slopes>(brick, first, weights)
             : tensor_of<Taps, TensorBrick::general, slopes>(brick, first, weights);
}

/// The tensor, and its slopes if they are wanted. @param first  The number of the first tap.
template <bool slopes>
Slopes<Eigen::Matrix3d> tensor_at(bool cubic, const TensorBrick& brick, int first, const Eigen::Vector3d& fraction) {
  return cubic ? tensor_in<CubicTaps, slopes>(brick, first, fraction)
               : tensor_in<LinearTaps, slopes>(brick, first, fraction);
}

}  // namespace

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world) {
  ++samples_;
  Eigen::Vector3d fraction;
  const int first = locate(world, fraction);
  return tensor_at<false>(field_->is_cubic(), brick_, first, fraction).value;
}

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world, const Eigen::Matrix<double, 3, 2>& along,
                                  std::array<Eigen::Matrix3d, 2>& derivatives) {
  ++samples_;
  Eigen::Vector3d fraction;
  const int first = locate(world, fraction);
  Eigen::Matrix<double, 3, 2> by_index = field_->to_index().linear() * along;
  // The tensor is constant along an axis with a single voxel.
  for (int axis = 0; axis < 3; ++axis)
    if (field_->voxels().sizes()[axis] == 0) by_index.row(axis).setZero();
  const Slopes<Eigen::Matrix3d> T = tensor_at<true>(field_->is_cubic(), brick_, first, fraction);
  by_index *= scale_;
  for (int i = 0; i < 2; ++i) derivatives[i] = by_index(0, i) * T.x + by_index(1, i) * T.y + by_index(2, i) * T.z;
  return T.value;
}

double TensorSampler::way_through_straight_brick(const Eigen::Vector3d& world, const Eigen::Vector3d& direction) {
  if (brick_.strongest > 0 || !brick_.bending) return 0;
  Eigen::Vector3d unused;
  locate(world, unused);
  if (brick_.strongest > 0) return 0;
  const double cells = TensorBrick::cells / scale_;
  const Eigen::Vector3d index = field_->to_index() * world - (TensorBrick::cells * at_).cast<double>() - first_;
  const Eigen::Vector3d along = field_->to_index().linear() * direction;
  double way = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (!(index[axis] >= 0 && index[axis] <= cells)) return 0;
    if (along[axis] != 0) way = std::min(way, ((along[axis] > 0 ? cells : 0) - index[axis]) / along[axis]);
  }
  return std::isfinite(way) ? way : 0;
}

void sample_tensors(const TensorField& field, const IndexPoints& points, float factor, float* components,
                    std::size_t stride) {
  TensorSampler sampler(field);
  const Eigen::Vector3d origin = (TensorBrick::cells * points.brick).cast<double>();
  for (std::size_t p = 0; p < points.count; ++p) {
    const Eigen::Vector3d from(points.position[0][p], points.position[1][p], points.position[2][p]);
    const Eigen::Matrix3f T = factor * sampler.at(field.to_world() * (origin + from)).cast<float>();
    for (std::size_t c = 0; c < 9; ++c) components[c * stride + p] = T.data()[c];
  }
}

}  // namespace tensorray
