#pragma once
/// @file tools/benchmark/parts.h
/// The parts of the benchmark. Each measures, and returns everything as JSON; the tables are made of that.

#include <functional>
#include <string>

#include <nlohmann/json.hpp>

namespace tensorray::benchmark {

using Json = nlohmann::ordered_json;

struct Options {
  bool quick = false;    ///< Tiny sizes: shows that everything works, measures nothing.
  bool million = false;  ///< Also the job of a million positions.
  /// Told what is measured next.
  std::function<void(const std::string&)> announce;
};

/// The processor, what its vectors do a second, and its memory.
Json measure_machine(const Options& options);

/// All kernels on all fields. @param machine  What measure_machine returned.
Json measure_kernels(const Options& options, const Json& machine);

/// From a file to bricks in memory. @param machine  As above.
Json measure_loading(const Options& options, const Json& machine);

/// From scene file to picture, by phase. @throw std::runtime_error if the program is not beside this one, or fails.
Json measure_jobs(const Options& options);

}  // namespace tensorray::benchmark
