#pragma once
/// @file tools/benchmark/measures/parts.h
/// The parts of the benchmark. Each part returns its measurements as JSON, and the tables are made from that.

#include <functional>
#include <string>

#include <nlohmann/json.hpp>

namespace tensorray::benchmark {

using Json = nlohmann::ordered_json;

struct Options {
  bool quick = false;    ///< Tiny sizes: shows that everything works; the numbers have no meaning.
  bool million = false;  ///< Also run the job of a million positions.
  std::string kernels;   ///< Measure only kernels whose names contain this.
  std::string field;     ///< Measure caustics and interpolation only of fields whose names contain this.
  /// Called with a description of what is measured next.
  std::function<void(const std::string&)> announce;
};

/// Measures the processor, the rates of its vector instructions, and the memory bandwidth.
Json measure_machine(const Options& options);

/// Measures the kernels on all fields.
/// @param machine  The result of measure_machine.
Json measure_kernels(const Options& options, const Json& machine);

/// Measures the time from a file to bricks in memory.
/// @param machine  The result of measure_machine.
Json measure_loading(const Options& options, const Json& machine);

/// Measures the time from scene file to picture, by phase.
/// @throw std::runtime_error if a program is not in the folder of this one, or fails.
Json measure_jobs(const Options& options);

/// Measures what it costs to keep work in checkpoints, and to make sums in a fixed order.
/// @throw as measure_jobs.
Json measure_keeping(const Options& options);

/// Measures the error of the light on a plate, and the time for it, with the flow map and with photons.
/// @throw as measure_jobs.
Json measure_caustics(const Options& options);

/// Measures how far pictures of fields of few voxels are from those of the formula, sampled at 257³, with each
/// interpolation and some methods.
/// @throw as measure_jobs.
Json measure_interpolation(const Options& options);

/// Measures how soon a live view shows a change: from a page's message to the picture's bytes, without the network.
Json measure_view(const Options& options);

}  // namespace tensorray::benchmark
