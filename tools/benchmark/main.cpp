/// `tensorray_bench`: Google Benchmark with the ratios within each case, and the name of the processor.

#include <fstream>
#include <map>
#include <string>

#include <benchmark/benchmark.h>

#include "tools/benchmark/questions.h"

namespace tensorray::bench {
namespace {

/// Adds a counter to each row: how many times faster it is than the first row of its case.
class RatioReporter : public benchmark::ConsoleReporter {
 public:
  RatioReporter() : ConsoleReporter(OO_None) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    std::vector<Run> rows = runs;
    for (Run& row : rows) {
      const std::string& name = row.run_name.function_name;
      const bool is_processor_time = row.run_name.time_type.empty();
      const double time = is_processor_time ? row.GetAdjustedCPUTime() : row.GetAdjustedRealTime();
      if (!(time > 0)) continue;  // It was skipped.
      const std::string group = name.substr(0, name.rfind('/')) + " " + row.aggregate_name;
      row.counters["ratio"] = first_times_.emplace(group, time).first->second / time;
    }
    ConsoleReporter::ReportRuns(rows);
  }

 private:
  std::map<std::string, double> first_times_;
};

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

}  // namespace
}  // namespace tensorray::bench

int main(int argc, char** argv) {
  using namespace tensorray::bench;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::AddCustomContext("processor", processor());
  add_rays();
  add_polariscope();
  add_renders();
  add_view();
  RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
}
