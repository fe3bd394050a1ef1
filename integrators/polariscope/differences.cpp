#include "integrators/polariscope/differences.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "volumes/bricks/brick_layout.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/polariscope/differences.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/highway.h>

#ifndef TENSORRAY_INTEGRATORS_DIFFERENCES
#define TENSORRAY_INTEGRATORS_DIFFERENCES
namespace tensorray {
namespace {

/// Where a point is: in the cell of some coefficients, from 0 to 1.
struct PointCell {
  const float* first;  // a and b of the first of its 4³ coefficients; null: they are 0.
  float fraction[3];
};

}  // namespace
}  // namespace tensorray
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Eight = hn::CappedTag<float, 8>;  // a and b of four coefficients along z.

/// The weights of the cubic B-spline along an axis.
HWY_INLINE void weights_of(float t, float (&weights)[4]) {
  const float u = 1 - t;
  weights[0] = u * u * u / 6;
  weights[1] = 2.0f / 3 - t * t * (2 - t) / 2;
  weights[2] = 2.0f / 3 - u * u * (2 - u) / 2;
  weights[3] = t * t * t / 6;
}

void sample_cells(const PointCell* cells, std::size_t count, float* a, float* b) {
  const Eight d;
  constexpr std::size_t row = 2 * CubicBrick::width;  // Floats between neighbours along y.
  for (std::size_t p = 0; p < count; ++p) {
    a[p] = b[p] = 0;
    if (!cells[p].first) continue;
    float x[4], y[4], z[4], twice[8], sums[8];
    weights_of(cells[p].fraction[0], x);
    weights_of(cells[p].fraction[1], y);
    weights_of(cells[p].fraction[2], z);
    for (int i = 0; i < 8; ++i) twice[i] = z[i / 2];
    for (std::size_t c = 0; c < 8; c += hn::Lanes(d)) {
      auto sum = hn::Zero(d);
      for (std::size_t i = 0; i < 4; ++i) {
        const float* const at = cells[p].first + i * CubicBrick::width * row + c;
        auto line = hn::Mul(hn::Set(d, y[0]), hn::LoadU(d, at));
        for (std::size_t j = 1; j < 4; ++j) line = hn::MulAdd(hn::Set(d, y[j]), hn::LoadU(d, at + j * row), line);
        sum = hn::MulAdd(hn::Set(d, x[i]), line, sum);
      }
      hn::StoreU(hn::Mul(sum, hn::LoadU(d, twice + c)), d, sums + c);
    }
    for (int i = 0; i < 8; i += 2) {
      a[p] += sums[i];
      b[p] += sums[i + 1];
    }
  }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(sample_cells);

namespace {

constexpr std::size_t kept_bricks = 512;  // That are converted; 5 MB.

/// The brick of the finest level at a point. `cell` and `fraction`, of level 0 in its brick, become those of the brick.
TensorBrick brick_of(const TensorField& field, const Eigen::Vector3i& at, Eigen::Vector3i& cell,
                     Eigen::Vector3d& fraction) {
  if (field.levels() == 1) return field.brick(at);
  const Eigen::Vector3f position = (cell.cast<double>() + fraction).cast<float>();
  const LeafBrick leaf = field.leaf(at, {position.x(), position.y(), position.z()});
  const Eigen::Vector3d first = Eigen::Map<const Eigen::Vector3f>(leaf.first.data()).cast<double>();
  const Eigen::Vector3d local = (cell.cast<double>() + fraction - first) * leaf.scale;
  cell = local.array().floor().matrix().cast<int>().cwiseMax(0).cwiseMin(TensorBrick::cells - 1);
  fraction = local - cell.cast<double>();
  return leaf.brick;
}

}  // namespace

DifferenceSampler::DifferenceSampler(const TensorField& field, const Eigen::Vector3d& u, const Eigen::Vector3d& w,
                                     double factor)
    : field_(field),
      to_a_(factor * (u * u.transpose() - w * w.transpose())),
      to_b_(factor * (u * w.transpose() + w * u.transpose())),
      converted_(field.is_cubic() ? kept_bricks : 0) {}

/// The isotropic part of T has no part in a and b.
const float* DifferenceSampler::coefficients_of(const TensorBrick& brick) {
  if (!(brick.strongest > 0)) return nullptr;
  const std::size_t place = reinterpret_cast<std::uintptr_t>(brick.bending) / 64 * 0x9E3779B97F4A7C15u >> 55;
  Converted& found = converted_[place];
  if (found.of == brick.bending) return found.values.data();
  found.of = brick.bending;
  found.values.resize(2 * CubicBrick::coefficients);
  // Component i, column by column, of T − T₂₂ I.
  std::array<float, TensorBrick::general> a{}, b{};
  for (int i = 0; i < TensorBrick::general; ++i) {
    const int stored = TensorBrick::stored_component(brick.components, i);
    a[static_cast<std::size_t>(stored)] += static_cast<float>(to_a_(i % 3, i / 3));
    b[static_cast<std::size_t>(stored)] += static_cast<float>(to_b_(i % 3, i / 3));
  }
  const auto components = static_cast<std::size_t>(brick.components);
  for (std::size_t k = 0; k < CubicBrick::coefficients; ++k) {
    float sum_a = 0, sum_b = 0;
    for (std::size_t c = 0; c < components; ++c) {
      sum_a += a[c] * brick.bending[k * components + c];
      sum_b += b[c] * brick.bending[k * components + c];
    }
    found.values[2 * k] = sum_a;
    found.values[2 * k + 1] = sum_b;
  }
  return found.values.data();
}

void DifferenceSampler::sample_cubic(const std::vector<Eigen::Vector3d>& points, std::vector<float>& a,
                                     std::vector<float>& b) {
  // A brick that is converted may take the place of one that is waited for: cells are sampled before that.
  constexpr std::size_t together = 64;
  std::array<PointCell, together> cells;
  const Eigen::Array3i first = field_.voxels().min().cast<int>().array();
  const Eigen::Array3d extent = field_.voxels().sizes().array();
  const Eigen::Array3i last_cell = (extent.cast<int>() - 1).max(0);
  const float *values = nullptr, *of = nullptr;
  std::size_t begin = 0, count = 0;
  const auto flush = [&] {
    HWY_DYNAMIC_DISPATCH(sample_cells)(cells.data(), count, &a[begin], &b[begin]);
    begin += count;
    count = 0;
  };
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Array3d inside = (point.array() - first.cast<double>()).max(0).min(extent);
    const Eigen::Array3i near = inside.cast<int>().min(last_cell);
    Eigen::Vector3d fraction = (inside - near.cast<double>()).matrix();
    Eigen::Vector3i cell = (first + near).matrix();
    const Eigen::Vector3i at(cell.x() >> 3, cell.y() >> 3, cell.z() >> 3);
    cell -= TensorBrick::cells * at;
    const TensorBrick brick = brick_of(field_, at, cell, fraction);
    if (count == together || brick.bending != of) {
      flush();
      of = brick.bending;
      values = coefficients_of(brick);
    }
    const int number = CubicBrick::coefficient(cell.x() - 1, cell.y() - 1, cell.z() - 1);
    cells[count++] = {
        values ? values + 2 * number : nullptr,
        {static_cast<float>(fraction.x()), static_cast<float>(fraction.y()), static_cast<float>(fraction.z())}};
  }
  flush();
}

void DifferenceSampler::sample(const std::vector<Eigen::Vector3d>& points, std::vector<float>& a,
                               std::vector<float>& b) {
  a.resize(points.size());
  b.resize(points.size());
  if (points.empty()) return;
  if (field_.is_cubic()) return sample_cubic(points, a, b);
  TensorSampler sampler(field_);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Eigen::Matrix3d T = sampler.at(field_.to_world() * points[p]);
    a[p] = static_cast<float>(to_a_.cwiseProduct(T).sum());
    b[p] = static_cast<float>(to_b_.cwiseProduct(T).sum());
  }
}

}  // namespace tensorray
#endif
