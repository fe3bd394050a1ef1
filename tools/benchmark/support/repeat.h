#pragma once
/// @file tools/benchmark/support/repeat.h
/// Measures the rate of work, in several repetitions.

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <ctime>

namespace tensorray::benchmark {

constexpr int repetitions = 5;

/// Units per second: the median, least and greatest of all repetitions.
struct Rate {
  double median = 0, least = 0, most = 0;
};

/// The rate from an odd number of values.
template <std::size_t Count>
Rate rate_of(std::array<double, Count> values) {
  std::sort(values.begin(), values.end());
  return {values[Count / 2], values.front(), values.back()};
}

/// Seconds of processor time of this thread, so that other programs on the machine do not count.
inline double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

inline double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A `prepare` for work that needs no preparation: `work` then receives the number of rounds.
inline std::uint64_t as_many(std::uint64_t rounds) { return rounds; }

/// @param prepare  Makes what `work` needs for a number of rounds; not timed.
/// @param work     Does the rounds, and returns the number of units done.
/// @param clock    thread_seconds, or wall_seconds where `work` uses several threads.
/// @param seconds  Approximate length of a repetition. The number of rounds is doubled until it is reached.
template <class Prepare, class Work>
Rate repeat(const Prepare& prepare, const Work& work, double (*clock)(), double seconds) {
  std::array<double, repetitions> rates{};
  std::uint64_t rounds = 1;
  for (std::size_t i = 0; i < rates.size();) {
    auto prepared = prepare(rounds);
    const double start = clock();
    const auto units = static_cast<double>(work(prepared));
    const double taken = clock() - start;
    if (i == 0 && taken < seconds / 2)
      rounds *= 2;
    else
      rates[i++] = units / taken;
  }
  return rate_of(rates);
}

}  // namespace tensorray::benchmark
