#include <algorithm>

#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/machine.h"

namespace tensorray::benchmark {

Json measure_machine(const Options& options) {
  options.announce("the processor");
  const Processor machine = processor();
  Json vectors = Json::array();
  const double seconds = options.quick ? 0.001 : 0.1;
  const double seconds_of_clock = std::max(seconds, 0.01);
  double clock = clock_rate(seconds_of_clock);
  for (const VectorRate& rate : vector_rates(seconds))
    vectors.push_back({{"instructions", rate.instructions},
                       {"lanes", rate.lanes},
                       {"multiply_adds_per_second", rate.multiply_adds},
                       {"adds_per_second", rate.adds},
                       {"both_per_second", rate.both}});
  clock = std::max(clock, clock_rate(seconds_of_clock));  // Clocks change: before the vectors and after them.
  options.announce("the memory");
  const std::size_t array_bytes = std::size_t{options.quick ? 1u : 256u} << 20;
  Json memory = Json::array();
  for (const int threads : {1, machine.threads}) {
    const Bandwidth rate = bandwidth(threads, array_bytes);
    memory.push_back(
        {{"threads", threads}, {"read_bytes_per_second", rate.read}, {"triad_bytes_per_second", rate.triad}});
  }
  return {{"processor", machine.model}, {"threads", machine.threads}, {"compiler", machine.compiler},
          {"cycles_per_second", clock}, {"vectors", vectors},         {"memory", memory}};
}

}  // namespace tensorray::benchmark
