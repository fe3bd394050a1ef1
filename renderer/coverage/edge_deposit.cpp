#include "renderer/coverage/area_deposit.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "renderer/coverage/edge_deposit.cpp"
#include <hwy/foreach_target.h>  // Must come before highway.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, 8>;  // A lane is an edge.
using Values = hn::VFromD<Doubles>;
using Lanes = hn::Mask<Doubles>;

constexpr std::size_t max_lanes = 8;

/// The parts of edges in one row of pixels: from column `left` to `right`, with the density times the height.
struct Spans {
  alignas(64) double left[max_lanes], right[max_lanes], weight[max_lanes];
  alignas(64) double first[max_lanes], second[max_lanes];  // What is covered of the first two columns.
  alignas(64) std::int64_t place[max_lanes];               // Of the first column.
};

using Planes = hn::CappedTag<double, DepositPlanes::count>;
using PlaneSums = hn::RebindToSigned<Planes>;

/// Adds to the pixels `at` and behind it the differences of what is covered of each and of the one before it, as
/// integers: equal ones cancel.
template <std::size_t count>
HWY_INLINE void add_covered(const double (&covered)[count], double before, const double* plane_weights,
                            std::uint64_t* at) {
  const Planes d;
  const PlaneSums di;
  for (std::size_t k = 0; k < DepositPlanes::count; k += hn::Lanes(d)) {
    const auto share = hn::LoadU(d, plane_weights + k), bits = hn::Set(d, integer_bits);
    auto last = hn::BitCast(di, hn::Add(hn::Mul(share, hn::Set(d, before)), bits));
    for (std::size_t i = 0; i < count; ++i) {
      const auto next = hn::BitCast(di, hn::Add(hn::Mul(share, hn::Set(d, covered[i])), bits));
      auto* const sums = reinterpret_cast<std::int64_t*>(at + i * DepositPlanes::count + k);
      hn::StoreU(hn::Add(hn::LoadU(di, sums), hn::Sub(next, last)), di, sums);
      last = next;
    }
  }
}

/// Adds a span of more than two columns.
HWY_INLINE void add_long_span(const Spans& spans, std::size_t lane, const double* plane_weights, std::uint64_t* pixel) {
  const double left = spans.left[lane], right = spans.right[lane], weight = spans.weight[lane];
  const double middle = (left + right) * 0.5, curvature = weight / (2 * (right - left));
  double area = 0, before = 0;
  for (double end = static_cast<double>(static_cast<std::int64_t>(left)) + 1;;
       end += 1, pixel += DepositPlanes::count) {
    const double inside = end - left;
    const bool is_last = end >= right;
    const double next = is_last ? weight * (end - middle) : curvature * inside * inside, covered = next - area;
    if (is_last) return add_covered({covered, weight}, before, plane_weights, pixel);
    add_covered({covered}, before, plane_weights, pixel);
    area = next;
    before = covered;
  }
}

/// The area to the left of column x that an edge covers is a parabola up to the edge's right end, then a line.
HWY_INLINE void add_spans(Values a, Values b, Values weight, Values row, Lanes lanes, const double* plane_weights,
                          const DepositPlanes& planes) {
  const Doubles d;
  const hn::RebindToSigned<Doubles> di;
  const auto left = hn::Min(a, b), right = hn::Max(a, b), first = hn::Floor(left);
  const auto middle = hn::Mul(hn::Add(left, right), hn::Set(d, 0.5));
  const auto curvature = hn::Div(weight, hn::Mul(hn::Set(d, 2), hn::Sub(right, left)));
  const auto next = hn::Add(first, hn::Set(d, 1)), second = hn::Add(next, hn::Set(d, 1));
  const auto inside = hn::Sub(next, left);
  const auto in_first = hn::Ge(next, right);
  const auto line = hn::Mul(weight, hn::Sub(next, middle)), parabola = hn::Mul(hn::Mul(curvature, inside), inside);
  const auto second_line = hn::Mul(weight, hn::Sub(second, middle));
  Spans spans;
  hn::Store(left, d, spans.left);
  hn::Store(right, d, spans.right);
  hn::Store(weight, d, spans.weight);
  hn::Store(hn::IfThenElse(in_first, line, parabola), d, spans.first);
  hn::Store(hn::IfThenElse(in_first, weight, hn::Sub(second_line, parabola)), d, spans.second);
  hn::Store(hn::ConvertTo(di, hn::Add(hn::Mul(row, hn::Set(d, static_cast<double>(planes.stride))), first)), di,
            spans.place);
  std::uint8_t active[8] = {}, is_long[8] = {};
  hn::StoreMaskBits(d, lanes, active);
  hn::StoreMaskBits(d, hn::Gt(right, second), is_long);
  for (unsigned left_over = active[0]; left_over != 0; left_over &= left_over - 1) {
    const auto lane = static_cast<std::size_t>(__builtin_ctz(left_over));
    std::uint64_t* const pixel = planes.sums + DepositPlanes::count * static_cast<std::size_t>(spans.place[lane]);
    if (is_long[0] >> lane & 1) {
      add_long_span(spans, lane, plane_weights, pixel);
      continue;
    }
    add_covered({spans.first[lane], spans.second[lane], spans.weight[lane]}, 0, plane_weights, pixel);
  }
}

void deposit_edges(const EdgeBatch& batch, const double* plane_weights, const DepositPlanes& planes) {
  const Doubles d;
  const auto first_row = hn::Set(d, planes.first_row), end_row = hn::Set(d, planes.end_row);
  const auto width = hn::Set(d, planes.width);
  for (std::size_t i = 0; i < batch.count; i += hn::Lanes(d)) {
    const auto from_y = hn::Load(d, batch.from_y + i), to_y = hn::Load(d, batch.to_y + i);
    const auto from_x = hn::Load(d, batch.from_x + i), to_x = hn::Load(d, batch.to_x + i);
    const auto given = hn::Load(d, batch.density + i);
    const auto goes_up = hn::Gt(from_y, to_y);
    const auto density = hn::IfThenElse(goes_up, hn::Neg(given), given);
    const auto top = hn::Min(from_y, to_y), bottom = hn::Max(from_y, to_y);
    const auto top_x = hn::IfThenElse(goes_up, to_x, from_x), bottom_x = hn::IfThenElse(goes_up, from_x, to_x);
    const auto slope = hn::Div(hn::Sub(bottom_x, top_x), hn::Sub(bottom, top));
    const auto end = hn::Min(bottom, end_row);
    // Rounding may take it over a border: by as much as long edges are long.
    const auto x_at = [&](Values at_y) {
      const auto x = hn::Add(top_x, hn::Mul(hn::Sub(at_y, top), slope));
      return hn::Min(hn::Max(x, hn::Zero(d)), width);
    };
    auto y = hn::Max(top, first_row), line = hn::Floor(y);
    auto lanes = hn::And(hn::Lt(y, end), hn::FirstN(d, batch.count - i));
    while (!hn::AllFalse(d, lanes)) {
      const auto row = hn::Sub(line, first_row);
      line = hn::Add(line, hn::Set(d, 1));
      const auto next = hn::Min(line, end);
      const auto x = x_at(y), next_x = x_at(next);
      add_spans(x, next_x, hn::Mul(density, hn::Sub(next, y)), row, lanes, plane_weights, planes);
      y = next;
      lanes = hn::And(lanes, hn::Lt(y, end));
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace tensorray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(deposit_edges);

void deposit_edges(const EdgeBatch& batch, const double* plane_weights, const DepositPlanes& planes) {
  HWY_DYNAMIC_DISPATCH(deposit_edges)(batch, plane_weights, planes);
}

}  // namespace tensorray
#endif
