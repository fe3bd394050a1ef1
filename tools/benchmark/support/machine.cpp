#include "tools/benchmark/support/machine.h"

#include <array>
#include <atomic>
#include <fstream>
#include <memory>
#include <numeric>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "tools/benchmark/support/repeat.h"

namespace tensorray::benchmark {
namespace {

std::string model_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

/// Each thread was the first to touch the part that it works on, so that the part is in the memory near the thread.
struct Arrays {
  std::size_t count;
  std::unique_ptr<double[]> a, b, c;
};

/// Calls `work(first, last)` on each thread, for one part of [0, count).
template <class Work>
void for_ranges(int threads, std::size_t count, const Work& work) {
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(
        0, threads,
        [&](int i) {
          const auto n = static_cast<std::size_t>(threads), part = static_cast<std::size_t>(i);
          work(count * part / n, count * (part + 1) / n);
        },
        tbb::static_partitioner());
  });
}

Arrays make_arrays(int threads, std::size_t bytes) {
  const std::size_t count = bytes / sizeof(double);
  Arrays arrays{count, std::unique_ptr<double[]>(new double[count]), std::unique_ptr<double[]>(new double[count]),
                std::unique_ptr<double[]>(new double[count])};
  for_ranges(threads, count, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      arrays.a[i] = 0;
      arrays.b[i] = 1;
      arrays.c[i] = 2;
    }
  });
  return arrays;
}

/// Adds to sixteen sums, so that additions do not wait for each other.
double sum(const double* values, std::size_t first, std::size_t last) {
  std::array<double, 16> sums{};
  for (std::size_t i = first; i + sums.size() <= last; i += sums.size())
    for (std::size_t lane = 0; lane < sums.size(); ++lane) sums[lane] += values[i + lane];
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

}  // namespace

Processor processor() {
  Processor result;
  result.model = model_name();
  result.compiler = "GCC " __VERSION__;
  result.threads = tbb::this_task_arena::max_concurrency();
  return result;
}

double clock_rate(double seconds) {
  constexpr std::uint64_t cycles = 3;  // Of a multiplication, from its factors to the product.
  volatile std::uint64_t number = 0x9e3779b97f4a7c15;
  const auto work = [&](std::uint64_t rounds) {
    const std::uint64_t factor = number;  // The compiler does not know it, so that it multiplies.
    std::uint64_t product = factor;
    for (std::uint64_t round = 0; round < rounds; ++round) product *= factor;
    number = product | 1;
    return cycles * rounds;
  };
  return repeat(as_many, work, thread_seconds, seconds).most;
}

Bandwidth bandwidth(int threads, std::size_t array_bytes) {
  const Arrays arrays = make_arrays(threads, array_bytes);
  std::atomic<double> unused{0};
  const auto passes = [&](std::size_t bytes, const auto& work) {
    return repeat(
               as_many,
               [&](std::uint64_t rounds) {
                 for (std::uint64_t round = 0; round < rounds; ++round) for_ranges(threads, arrays.count, work);
                 return rounds * bytes;
               },
               wall_seconds, 0.05)
        .median;
  };
  Bandwidth result;
  result.read =
      passes(array_bytes, [&](std::size_t first, std::size_t last) { unused = sum(arrays.b.get(), first, last); });
  result.triad = passes(3 * array_bytes, [&](std::size_t first, std::size_t last) {
    double* const a = arrays.a.get();
    const double *const b = arrays.b.get(), *const c = arrays.c.get();
    for (std::size_t i = first; i < last; ++i) a[i] = b[i] + 3 * c[i];
  });
  return result;
}

}  // namespace tensorray::benchmark
