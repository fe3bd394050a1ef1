#include "volumes/sampling/tensor_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "volumes/bricks/cubic_brick.h"

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
  if (at != at_) {
    at_ = at;
    brick_ = field_->brick(at);
  }
  cell -= TensorBrick::cells * at;
  if (field_->is_cubic()) return CubicBrick::coefficient(cell.x() - 1, cell.y() - 1, cell.z() - 1);
  return TensorBrick::voxel(cell.x(), cell.y(), cell.z());
}

namespace {

constexpr int step_x = TensorBrick::voxel(1, 0, 0), step_y = TensorBrick::voxel(0, 1, 0);

/// The eight floats that bend light fill vector registers; T₂₂ is interpolated separately. Of symmetric tensors there
/// are five; what follows them is interpolated, too, and not used.
using Eight = Eigen::Array<double, 8, 1>;

Eigen::Matrix3d to_matrix(const TensorBrick& brick, const Eight& bending, double trailing) {
  Eigen::Matrix3d T;
  for (int i = 0; i < 8; ++i) T.data()[i] = bending[TensorBrick::stored_component(brick.components, i)];
  T(0, 0) += trailing;
  T(1, 1) += trailing;
  T(2, 2) = trailing;
  return T;
}

/// A value, and its slopes along the axes of index space.
template <class Value>
struct Slopes {
  Value value, x, y, z;
};

/// Trilinear interpolation in a cell: along z, then y, then x. `load` gives the components of a voxel.
template <class Value, class Load>
Slopes<Value> interpolate(int voxel, const Eigen::Vector3d& f, Load load) {
  Value value[2], slope_y[2], slope_z[2];
  for (int x = 0; x < 2; ++x) {
    const int face = voxel + x * step_x;
    const Value near = load(face), far = load(face + step_y);
    const Value near_z = load(face + 1) - near, far_z = load(face + step_y + 1) - far;
    const Value near_value = near + f.z() * near_z;
    slope_y[x] = far + f.z() * far_z - near_value;
    slope_z[x] = near_z + f.y() * (far_z - near_z);
    value[x] = near_value + f.y() * slope_y[x];
  }
  const Value slope_x = value[1] - value[0];
  return {value[0] + f.x() * slope_x, slope_x, slope_y[0] + f.x() * (slope_y[1] - slope_y[0]),
          slope_z[0] + f.x() * (slope_z[1] - slope_z[0])};
}

Eight bending(const TensorBrick& brick, int voxel) {
  const float* const stored = brick.bending + TensorBrick::bending_offset(brick.components, voxel);
  return Eigen::Map<const Eigen::Array<float, 8, 1>>(stored).cast<double>();
}

/// Weights of the four coefficients about a point along each axis.
struct SplineWeights {
  double value[3][4], slope[3][4];

  explicit SplineWeights(const Eigen::Vector3d& fraction) {
    for (int axis = 0; axis < 3; ++axis) {
      cubic_weights(fraction[axis], value[axis]);
      cubic_slopes(fraction[axis], slope[axis]);
    }
  }
};

/// to += weight · from
template <std::size_t count, class Number>
void add(double weight, const Number* from, std::array<double, count>& to) {
  for (std::size_t i = 0; i < count; ++i) to[i] += weight * from[i];
}

/// The cubic B-spline of the numbers of a coefficient, and its slopes if they are wanted: sums along y, then x, then z.
/// @param first  Numbers of the first of 4³ coefficients; those along z follow each other.
template <int numbers, bool slopes>
Slopes<std::array<double, numbers>> spline(const float* first, const SplineWeights& weights) {
  constexpr std::size_t row = 4 * numbers;
  std::array<double, row> values{}, by_x{}, by_y{};
  for (int x = 0; x < 4; ++x) {
    std::array<double, row> lines{}, lines_by_y{};
    for (int y = 0; y < 4; ++y) {
      const float* const coefficients = first + (x * CubicBrick::width + y) * CubicBrick::width * numbers;
      add(weights.value[1][y], coefficients, lines);
      if constexpr (slopes) add(weights.slope[1][y], coefficients, lines_by_y);
    }
    add(weights.value[0][x], lines.data(), values);
    if constexpr (slopes) {
      add(weights.slope[0][x], lines.data(), by_x);
      add(weights.value[0][x], lines_by_y.data(), by_y);
    }
  }
  Slopes<std::array<double, numbers>> result{};
  for (int z = 0; z < 4; ++z) {
    add(weights.value[2][z], &values[z * numbers], result.value);
    if constexpr (!slopes) continue;
    add(weights.value[2][z], &by_x[z * numbers], result.x);
    add(weights.value[2][z], &by_y[z * numbers], result.y);
    add(weights.slope[2][z], &values[z * numbers], result.z);
  }
  return result;
}

template <std::size_t components>
Eigen::Matrix3d to_matrix(const TensorBrick& brick, const std::array<double, components>& bending, double trailing) {
  Eight eight;
  std::copy(bending.begin(), bending.end(), eight.data());
  return to_matrix(brick, eight, trailing);
}

template <int components, bool slopes>
Slopes<Eigen::Matrix3d> cubic_tensor(const TensorBrick& brick, int first, const SplineWeights& weights) {
  const float* const bending = brick.bending + CubicBrick::bending_offset(components, first);
  const auto most = spline<components, slopes>(bending, weights);
  const auto last = spline<1, slopes>(brick.trailing + first, weights);
  Slopes<Eigen::Matrix3d> result;
  result.value = to_matrix(brick, most.value, last.value[0]);
  if constexpr (slopes) {
    result.x = to_matrix(brick, most.x, last.x[0]);
    result.y = to_matrix(brick, most.y, last.y[0]);
    result.z = to_matrix(brick, most.z, last.z[0]);
  }
  return result;
}

/// The tensor of a cubic field, and its slopes if they are wanted. @param first  The number of the first of the 4³
/// coefficients.
template <bool slopes>
Slopes<Eigen::Matrix3d> cubic_tensor(const TensorBrick& brick, int first, const Eigen::Vector3d& fraction) {
  const SplineWeights weights(fraction);
  return brick.components == TensorBrick::symmetric
             ? cubic_tensor<TensorBrick::symmetric, slopes>(brick, first, weights)
             : cubic_tensor<TensorBrick::general, slopes>(brick, first, weights);
}

}  // namespace

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world) {
  ++samples_;
  Eigen::Vector3d f;
  const int voxel = locate(world, f);
  if (field_->is_cubic()) return cubic_tensor<false>(brick_, voxel, f).value;
  const double wx[2] = {1 - f.x(), f.x()}, wy[2] = {1 - f.y(), f.y()}, wz[2] = {1 - f.z(), f.z()};
  Eight eight = Eight::Zero();
  double last = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
    const int at = voxel + x * step_x + y * step_y + z;
    const double weight = wx[x] * wy[y] * wz[z];
    eight += weight * bending(brick_, at);
    last += weight * brick_.trailing[at];
  }
  return to_matrix(brick_, eight, last);
}

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world, const Eigen::Matrix<double, 3, 2>& along,
                                  std::array<Eigen::Matrix3d, 2>& derivatives) {
  ++samples_;
  Eigen::Vector3d f;
  const int voxel = locate(world, f);
  Eigen::Matrix<double, 3, 2> by_index = field_->to_index().linear() * along;
  // The tensor is constant along an axis with a single voxel.
  for (int axis = 0; axis < 3; ++axis)
    if (field_->voxels().sizes()[axis] == 0) by_index.row(axis).setZero();
  if (field_->is_cubic()) {
    const Slopes<Eigen::Matrix3d> T = cubic_tensor<true>(brick_, voxel, f);
    for (int i = 0; i < 2; ++i) derivatives[i] = by_index(0, i) * T.x + by_index(1, i) * T.y + by_index(2, i) * T.z;
    return T.value;
  }
  const auto eight = interpolate<Eight>(voxel, f, [&](int at) { return bending(brick_, at); });
  const auto last = interpolate<double>(voxel, f, [&](int at) { return double{brick_.trailing[at]}; });
  for (int i = 0; i < 2; ++i) {
    const double x = by_index(0, i), y = by_index(1, i), z = by_index(2, i);
    derivatives[i] = to_matrix(brick_, x * eight.x + y * eight.y + z * eight.z, x * last.x + y * last.y + z * last.z);
  }
  return to_matrix(brick_, eight.value, last.value);
}

double TensorSampler::way_through_straight_brick(const Eigen::Vector3d& world, const Eigen::Vector3d& direction) {
  if (brick_.strongest > 0 || !brick_.bending) return 0;
  Eigen::Vector3d unused;
  locate(world, unused);
  if (brick_.strongest > 0) return 0;
  const Eigen::Vector3d index = field_->to_index() * world - (TensorBrick::cells * at_).cast<double>();
  const Eigen::Vector3d along = field_->to_index().linear() * direction;
  double way = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (!(index[axis] >= 0 && index[axis] <= TensorBrick::cells)) return 0;
    if (along[axis] != 0) way = std::min(way, ((along[axis] > 0 ? TensorBrick::cells : 0) - index[axis]) / along[axis]);
  }
  return std::isfinite(way) ? way : 0;
}

}  // namespace tensorray
