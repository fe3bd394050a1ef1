#include "integrators/polariscope/differences.h"

#include <algorithm>

#include "volumes/bricks/brick_layout.h"
#include "volumes/sampling/tensor_sampler.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/polariscope/differences.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, ray_lanes>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
constexpr int lanes = static_cast<int>(hn::MaxLanes(Floats()));

/// Sets the cells of points, and the places in them, from 0 to 1.
HWY_INLINE void locate(const CellBox& box, const double (&origin)[3][ray_lanes], const double* place, int at,
                       std::int32_t (&cell)[3][lanes], float (&fraction)[3][lanes]) {
  for (int axis = 0; axis < 3; ++axis) {
    const double along = box.along[axis], first = box.first[axis], extent = box.extent[axis];
    const std::int32_t last = box.last[axis];
    for (int i = 0; i < lanes; ++i) {
      double p = origin[axis][at + i] + place[at + i] * along - first;
      p = p > 0 ? p : 0;  // In this order NaN becomes 0.
      p = (p < extent ? p : extent) * box.scale;
      std::int32_t near = static_cast<std::int32_t>(p);
      near = near < last ? near : last;
      cell[axis][i] = near;
      fraction[axis][i] = static_cast<float>(p - near);
    }
  }
}

/// The weights of the cubic B-spline along an axis.
HWY_INLINE void weights_of(F t, F (&weights)[4]) {
  const auto set = [](float value) HWY_ATTR { return hn::Set(Floats(), value); };
  const F sixth = set(1.0f / 6), half = set(0.5f), u = set(1) - t;
  weights[0] = u * u * u * sixth;
  weights[1] = set(2.0f / 3) - half * t * t * (set(2) - t);
  weights[2] = set(2.0f / 3) - half * u * u * (set(2) - u);
  weights[3] = t * t * t * sixth;
}

/// a and b of points in one cell.
HWY_INLINE void sum_cell(const float* first, const F (&weights)[3][4], F& a, F& b) {
  const Floats d;
  a = b = hn::Zero(d);
#pragma GCC unroll 4
  for (int i = 0; i < 4; ++i) {
    F sheet_a = hn::Zero(d), sheet_b = sheet_a;
#pragma GCC unroll 4
    for (int j = 0; j < 4; ++j) {
      const float* const at = first + 2 * CubicBrick::width * (i * CubicBrick::width + j);
      F line_a = weights[2][0] * hn::Set(d, at[0]), line_b = weights[2][0] * hn::Set(d, at[1]);
#pragma GCC unroll 3
      for (int k = 1; k < 4; ++k) {
        line_a = hn::MulAdd(weights[2][k], hn::Set(d, at[2 * k]), line_a);
        line_b = hn::MulAdd(weights[2][k], hn::Set(d, at[2 * k + 1]), line_b);
      }
      sheet_a = hn::MulAdd(weights[1][j], line_a, sheet_a);
      sheet_b = hn::MulAdd(weights[1][j], line_b, sheet_b);
    }
    a = hn::MulAdd(weights[0][i], sheet_a, a);
    b = hn::MulAdd(weights[0][i], sheet_b, b);
  }
}

void sample_steps(const CellBox& box, DifferenceSampler& sampler, RaySteps& steps) {
  const Floats d;
  const Ints ints;
  for (int point = 0; point < 2; ++point)
    for (int at = 0; at < ray_lanes; at += lanes) {
      alignas(64) std::int32_t cell[3][lanes];
      alignas(64) float fraction[3][lanes];
      locate(box, steps.origin, steps.place[point], at, cell, fraction);
      F a = hn::Zero(d), b = a;
      auto left = hn::Gt(hn::LoadU(d, steps.length + at), a);
      for (auto lane = hn::FindFirstTrue(d, left); lane >= 0; lane = hn::FindFirstTrue(d, left)) {
        const std::int32_t of[3] = {cell[0][lane], cell[1][lane], cell[2][lane]};
        auto same = left;
        for (int axis = 0; axis < 3; ++axis)
          same = hn::And(same, hn::RebindMask(d, hn::Eq(hn::Load(ints, cell[axis]), hn::Set(ints, of[axis]))));
        left = hn::AndNot(same, left);
        const DifferenceSampler::Cell found = sampler.find(of);
        if (!found.first) continue;
        F weights[3][4], cell_a, cell_b;
        for (int axis = 0; axis < 3; ++axis)
          weights_of(hn::MulAdd(hn::Load(d, fraction[axis]), hn::Set(d, found.scale), hn::Set(d, found.offset[axis])),
                     weights[axis]);
        sum_cell(found.first, weights, cell_a, cell_b);
        a = hn::IfThenElse(same, cell_a, a);
        b = hn::IfThenElse(same, cell_b, b);
      }
      hn::StoreU(a, d, steps.a[point] + at);
      hn::StoreU(b, d, steps.b[point] + at);
    }
}

}  // namespace
}  // namespace tensorray::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(sample_steps);

constexpr std::size_t kept_bricks = 512;  // That are converted; 5 MB.

DifferenceSampler::DifferenceSampler(const TensorField& field, const Eigen::Vector3d& along, const Eigen::Vector3d& u,
                                     const Eigen::Vector3d& w, double factor)
    : field_(field),
      finest_(field.levels() - 1),
      first_(field.voxels().min().cast<int>() * (1 << finest_)),
      along_(along),
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
  const Eigen::Matrix3f to_a = to_a_.cast<float>(), to_b = to_b_.cast<float>();
  for (int k = 0; k < CubicBrick::coefficients; ++k) {
    float* const to = found.values.data() + 2 * k;
    to[0] = to[1] = 0;
    for (int i = 0; i < TensorBrick::general; ++i) {  // Component i, column by column, of T − T₂₂ I.
      const int stored = TensorBrick::stored_component(brick.components, i);
      const float value = brick.bending[CubicBrick::bending_offset(brick.components, k) + stored];
      to[0] += to_a.data()[i] * value;
      to[1] += to_b.data()[i] * value;
    }
  }
  return found.values.data();
}

DifferenceSampler::Cell DifferenceSampler::find(const std::int32_t (&cell)[3]) {
  const Eigen::Vector3i index = first_ + Eigen::Vector3i(cell[0], cell[1], cell[2]);
  const int shift = 3 + finest_;
  const Eigen::Vector3i at(index.x() >> shift, index.y() >> shift, index.z() >> shift);
  Eigen::Vector3i within = index - (1 << shift) * at;
  Cell result{nullptr, 1, {0, 0, 0}};
  if (finest_ > 0) {
    const float size = 1.0f / static_cast<float>(1 << finest_);  // Of the cell, voxels of level 0.
    const Eigen::Vector3f corner = size * within.cast<float>(), middle = corner.array() + size / 2;
    const LeafBrick leaf = field_.leaf(at, {middle.x(), middle.y(), middle.z()});
    const Eigen::Map<const Eigen::Vector3f> first(leaf.first.data());
    within = (leaf.scale * (middle - first)).cast<int>();
    result.scale = leaf.scale * size;
    Eigen::Map<Eigen::Vector3f>(result.offset) = leaf.scale * (corner - first) - within.cast<float>();
    values_ = coefficients_of(leaf.brick);
  } else if (at != at_) {
    values_ = coefficients_of(field_.brick(at));
    at_ = at;
  }
  if (values_) result.first = values_ + 2 * CubicBrick::coefficient(within.x() - 1, within.y() - 1, within.z() - 1);
  return result;
}

void DifferenceSampler::sample(RaySteps& steps) {
  if (!field_.is_cubic()) {
    TensorSampler sampler(field_);
    for (int point = 0; point < 2; ++point)
      for (int i = 0; i < ray_lanes; ++i) {
        steps.a[point][i] = steps.b[point][i] = 0;
        if (!(steps.length[i] > 0)) continue;
        const Eigen::Vector3d index(steps.origin[0][i], steps.origin[1][i], steps.origin[2][i]);
        const Eigen::Matrix3d T = sampler.at(field_.to_world() * (index + steps.place[point][i] * along_));
        steps.a[point][i] = static_cast<float>(to_a_.cwiseProduct(T).sum());
        steps.b[point][i] = static_cast<float>(to_b_.cwiseProduct(T).sum());
      }
    return;
  }
  CellBox box;
  box.scale = 1 << finest_;
  for (int axis = 0; axis < 3; ++axis) {
    box.along[axis] = along_[axis];
    box.first[axis] = field_.voxels().min()[axis];
    box.extent[axis] = field_.voxels().sizes()[axis];
    box.last[axis] = std::max(static_cast<int>(box.extent[axis] * box.scale) - 1, 0);
  }
  HWY_DYNAMIC_DISPATCH(sample_steps)(box, *this, steps);
}

}  // namespace tensorray
#endif
