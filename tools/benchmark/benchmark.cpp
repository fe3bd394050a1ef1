/// @file tools/benchmark/benchmark.cpp
/// `tensorray_bench`: runs the benchmarks and prints the results.

#include <cstdio>
#include <map>
#include <set>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/measures/tables.h"
#include "tools/command_line/run_and_report.h"

namespace tensorray::benchmark {
namespace {

constexpr const char* description =
    "Measures how fast this machine bends light through tensor fields.\n\n"
    "  machine  the processor, its vectors and its memory: the bounds\n"
    "  kernels  tensorray's kernels and those of other libraries, on the same fields, rays and step\n"
    "  loading  reading a file of 256³ voxels and making bricks from it\n"
    "  jobs     whole renders, from scene file to picture, by phase, with one thread and with all\n"
    "  keeping  what checkpoints cost, and sums in a fixed order\n"
    "  caustics the error of the light on a plate, with the flow map and with photons\n"
    "  interpolation  the error of a picture against the formula that its voxels sample, by interpolant and step\n"
    "  view     a live view: from a change to its first and its finished picture\n\n"
    "A sample is one look-up of a tensor, with the step that uses it. Numbers are medians of five repetitions; ratios "
    "are to the first row. A complete run takes about a quarter of an hour on two cores. Run no other programs at the "
    "same "
    "time.";

struct CommandLine {
  Options options;
  std::string only;
  bool json = false;
};

/// Shows progress on a terminal, in one line that is overwritten each time.
void announce(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r\033[K{}", what.empty() ? "" : "measuring " + what + " ...");
}

Json measure(const CommandLine& line) {
  const auto wanted = [&](const char* part) { return line.only.empty() || line.only == part; };
  Json results = {{"version", TENSORRAY_VERSION}, {"quick", line.options.quick}};
  results["machine"] = measure_machine(line.options);  // The other measurements are compared with the machine's limits.
  if (wanted("kernels")) results["kernels"] = measure_kernels(line.options, results["machine"]);
  if (wanted("loading")) results["loading"] = measure_loading(line.options, results["machine"]);
  if (wanted("jobs")) results["jobs"] = measure_jobs(line.options);
  if (wanted("keeping")) results["keeping"] = measure_keeping(line.options);
  if (wanted("caustics")) results["caustics"] = measure_caustics(line.options);
  if (line.only == "interpolation") results["interpolation"] = measure_interpolation(line.options);
  if (wanted("view")) results["view"] = measure_view(line.options);
  return results;
}

void run(int argc, char** argv) {
  CommandLine line;
  line.options.announce = announce;
  CLI::App app(description, "tensorray_bench");
  app.add_flag("--json", line.json, "Print everything as JSON instead of tables");
  app.add_option("--only", line.only, "Measure only this part")
      ->check(CLI::IsMember({"machine", "kernels", "loading", "jobs", "keeping", "caustics", "interpolation", "view"}))
      ->type_name("PART");
  app.add_flag("--quick", line.options.quick,
               "Tiny sizes, takes seconds: checks that everything works; the numbers mean nothing");
  app.add_flag("--million", line.options.million,
               "Also run a job with a million positions of 32 wavelengths on a plate of 1024² pixels");
  app.add_option("--kernels", line.options.kernels, "Measure only kernels whose names contain this text, such as AVX2")
      ->type_name("TEXT");
  app.add_option("--field", line.options.field,
                 "Measure caustics and interpolation only of fields whose names contain this text, such as vortex")
      ->type_name("TEXT");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help
    app.exit(request);
    return;
  }
  const Json results = measure(line);
  announce("");
  fmt::print("{}", line.json ? results.dump(2) + "\n" : tables(results));
}

}  // namespace
}  // namespace tensorray::benchmark

int main(int argc, char** argv) {
  return tensorray::run_and_report([&] { tensorray::benchmark::run(argc, argv); });
}
