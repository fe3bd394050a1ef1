#include "renderer/density/convolution.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "renderer/density/convolution.cpp"
#include <hwy/foreach_target.h>  // Must come before highway.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Computes four vectors of sums at a time, so that they stay in registers.
void convolve(const double* in, std::size_t step, const double* filter, std::size_t radius, double* out,
              std::size_t count) {
  const hn::CappedTag<double, convolution_group / 4> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < count; i += 4 * lanes) {
    const double* const middle = in + i + radius * step;
    auto sum0 = hn::Mul(hn::Set(d, filter[radius]), hn::LoadU(d, middle));
    auto sum1 = hn::Mul(hn::Set(d, filter[radius]), hn::LoadU(d, middle + lanes));
    auto sum2 = hn::Mul(hn::Set(d, filter[radius]), hn::LoadU(d, middle + 2 * lanes));
    auto sum3 = hn::Mul(hn::Set(d, filter[radius]), hn::LoadU(d, middle + 3 * lanes));
    for (std::size_t k = 1; k <= radius; ++k) {
      const auto weight = hn::Set(d, filter[radius + k]);
      const double *const before = middle - k * step, *const after = middle + k * step;
      const auto pair = [&](std::size_t at) { return hn::Add(hn::LoadU(d, before + at), hn::LoadU(d, after + at)); };
      sum0 = hn::MulAdd(weight, pair(0), sum0);
      sum1 = hn::MulAdd(weight, pair(lanes), sum1);
      sum2 = hn::MulAdd(weight, pair(2 * lanes), sum2);
      sum3 = hn::MulAdd(weight, pair(3 * lanes), sum3);
    }
    hn::StoreU(sum0, d, out + i);
    hn::StoreU(sum1, d, out + i + lanes);
    hn::StoreU(sum2, d, out + i + 2 * lanes);
    hn::StoreU(sum3, d, out + i + 3 * lanes);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace tensorray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(convolve);

void convolve(const double* in, std::size_t step, const std::vector<double>& filter, double* out, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(convolve)(in, step, filter.data(), filter.size() / 2, out, count);
}

}  // namespace tensorray
#endif
