#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/benchmark/support/vector_rates.cpp"
#include <hwy/foreach_target.h>
// highway.h must come after foreach_target.h, which compiles this file once for every set of instructions.
#include <hwy/highway.h>

#include "tools/benchmark/support/machine.h"
#include "tools/benchmark/support/repeat.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::benchmark::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

int lanes() { return static_cast<int>(hn::Lanes(hn::ScalableTag<float>())); }

/// Independent chains of operations. Their number hides the latency, of at most five cycles on two pipes.
constexpr int chains = 12;

/// @param start  A number that the compiler does not know. Each chain starts at another multiple of it: the compiler
///               would make one of chains that it knows to be equal.
/// @return a value that depends on all chains, so that the compiler keeps them.
template <class Operation>
HWY_INLINE float run_chains(std::size_t rounds, float start, const Operation& operation) {
  const hn::ScalableTag<float> tag;
  hn::Vec<decltype(tag)> chain[chains];
  for (int i = 0; i < chains; ++i) chain[i] = hn::Set(tag, start * static_cast<float>(i + 1));
  for (std::size_t round = 0; round < rounds; ++round) {
#pragma GCC unroll 12
    for (int i = 0; i < chains; ++i) chain[i] = operation(i, chain[i]);
  }
  auto sum = chain[0];
  for (int i = 1; i < chains; ++i) sum = hn::Add(sum, chain[i]);
  return hn::GetLane(hn::SumOfLanes(tag, sum));
}

float multiply_add(std::size_t rounds, float start) {
  const hn::ScalableTag<float> tag;
  const auto factor = hn::Set(tag, 0.999f), term = hn::Set(tag, start);
  return run_chains(rounds, start, [&](int, auto x) HWY_ATTR { return hn::MulAdd(x, factor, term); });
}

float add(std::size_t rounds, float start) {
  const hn::ScalableTag<float> tag;
  const auto term = hn::Set(tag, start);
  return run_chains(rounds, start, [&](int, auto x) HWY_ATTR { return hn::Add(x, term); });
}

float both(std::size_t rounds, float start) {
  const hn::ScalableTag<float> tag;
  const auto factor = hn::Set(tag, 0.999f), term = hn::Set(tag, start);
  return run_chains(rounds, start, [&](int i, auto x) HWY_ATTR {
    return i % 2 == 0 ? hn::MulAdd(x, factor, term) : hn::Add(x, term);
  });
}

}  // namespace tensorray::benchmark::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray::benchmark {

HWY_EXPORT(lanes);
HWY_EXPORT(multiply_add);
HWY_EXPORT(add);
HWY_EXPORT(both);

namespace {

constexpr std::uint64_t operations_per_round = 12;  // The chains.

/// Operations per second of `run(rounds, start)`.
template <class Run>
double rate_of_chains(const Run& run, double seconds) {
  volatile float start = 0.001f, unused = 0;
  const auto work = [&](std::uint64_t rounds) {
    unused = run(rounds, start);
    return operations_per_round * rounds;
  };
  return repeat(as_many, work, thread_seconds, seconds).median;
}

}  // namespace

std::vector<VectorRate> vector_rates(double seconds) {
  std::vector<VectorRate> rates;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
    VectorRate rate;
    rate.instructions = hwy::TargetName(target);
    rate.lanes = HWY_DYNAMIC_DISPATCH(lanes)();
    const auto measured = [&](const auto& run) { return rate_of_chains(run, seconds); };
    rate.multiply_adds =
        measured([](std::size_t n, float start) { return HWY_DYNAMIC_DISPATCH(multiply_add)(n, start); });
    rate.adds = measured([](std::size_t n, float start) { return HWY_DYNAMIC_DISPATCH(add)(n, start); });
    rate.both = measured([](std::size_t n, float start) { return HWY_DYNAMIC_DISPATCH(both)(n, start); });
    rates.push_back(rate);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
  return rates;
}

}  // namespace tensorray::benchmark
#endif
