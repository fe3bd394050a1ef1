#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/benchmark/vector_rates.cpp"
#include <hwy/foreach_target.h>
// highway.h must come after foreach_target.h, which compiles this file once for every set of instructions.
#include <hwy/highway.h>

#include "tools/benchmark/machine.h"
#include "tools/benchmark/repeat.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::benchmark::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

int lanes() { return static_cast<int>(hn::Lanes(hn::ScalableTag<float>())); }

/// Ten independent chains hide the latency of five cycles on two ports.
/// @return a value that depends on all chains, so that the compiler keeps them.
float multiply_add(std::size_t rounds) {
  const hn::ScalableTag<float> tag;
  const auto factor = hn::Set(tag, 0.999f), term = hn::Set(tag, 0.001f);
  auto a = hn::Zero(tag), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a;
  for (std::size_t round = 0; round < rounds; ++round) {
    a = hn::MulAdd(a, factor, term);
    b = hn::MulAdd(b, factor, term);
    c = hn::MulAdd(c, factor, term);
    d = hn::MulAdd(d, factor, term);
    e = hn::MulAdd(e, factor, term);
    f = hn::MulAdd(f, factor, term);
    g = hn::MulAdd(g, factor, term);
    h = hn::MulAdd(h, factor, term);
    i = hn::MulAdd(i, factor, term);
    j = hn::MulAdd(j, factor, term);
  }
  const auto sum =
      hn::Add(hn::Add(hn::Add(a, b), hn::Add(c, d)), hn::Add(hn::Add(e, f), hn::Add(hn::Add(g, h), hn::Add(i, j))));
  return hn::GetLane(hn::SumOfLanes(tag, sum));
}

}  // namespace tensorray::benchmark::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray::benchmark {

HWY_EXPORT(lanes);
HWY_EXPORT(multiply_add);

std::vector<VectorRate> vector_rates(double seconds) {
  constexpr std::size_t chains = 10;
  std::vector<VectorRate> rates;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    VectorRate rate;
    rate.instructions = hwy::TargetName(target);
    rate.lanes = HWY_DYNAMIC_DISPATCH(lanes)();
    volatile float unused = 0;
    const auto work = [&](std::uint64_t rounds) {
      unused = HWY_DYNAMIC_DISPATCH(multiply_add)(rounds);
      return chains * rounds;
    };
    rate.multiply_adds = repeat(as_many, work, thread_seconds, seconds).median;
    rates.push_back(rate);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
  return rates;
}

}  // namespace tensorray::benchmark
#endif
