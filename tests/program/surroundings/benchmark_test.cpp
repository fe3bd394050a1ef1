// `tensorray_bench --quick` measures the same rays with every kernel, and reports wrong input in one line.

#include <set>
#include <string>

#include "tests/program/support.h"

namespace tensorray::test {
namespace {

/// Like Program, for the benchmark.
class Benchmark : public Program {
 protected:
  Outcome measure(const std::string& options) const {
    const std::string benchmark = std::filesystem::path(TENSORRAY_BINARY).replace_filename("tensorray_bench").string();
    const std::string files = " > '" + in_folder("out").string() + "' 2> '" + in_folder("error").string() + "'";
    const int status = std::system(("'" + benchmark + "' " + options + files).c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(in_folder("out")), read_file(in_folder("error"))};
  }
};

TEST_F(Benchmark, EveryKernelFollowsTheSameRays) {
  const Outcome outcome = measure("--quick --json --only kernels");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto results = nlohmann::json::parse(outcome.out);
  std::set<std::string> names;
  for (const auto& measurement : results.at("kernels").at("measurements")) {
    const std::string name = measurement.at("name");
    names.insert(name.substr(0, name.rfind(' ')));
    EXPECT_EQ(measurement.at("kernels")[0].at("ratio"), 1) << name;
    EXPECT_GE(measurement.at("kernels").size(), 4u) << name;
    for (const auto& row : measurement.at("kernels")) {
      EXPECT_GT(row.at("samples_per_second"), 0) << name << row;
      // The limit is the error of a step: the plain kernels use the exponential only to second order, and a strong
      // vortex multiplies the rest.
      if (row.contains("greatest_difference_in_voxels") && name.rfind("diverging", 0) != 0) {
        EXPECT_LT(row.at("greatest_difference_in_voxels"), 0.01) << name << row;
      }
    }
  }
  EXPECT_EQ(names, (std::set<std::string>{"coherent", "cold cells", "half empty", "parting", "diverging", "as rendered",
                                          "Morton order", "dense"}));
}

/// A kernel cannot be faster than the bound, and a bound that counts operations which the compiler removed is too high.
TEST_F(Benchmark, VectorsAreNotFasterThanTheClockAndThePipes) {
  const Outcome outcome = measure("--quick --json --only machine");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto machine = nlohmann::json::parse(outcome.out).at("machine");
#if defined(__x86_64__)
  constexpr double pipes = 2, pipes_of_both = 4;
#else
  constexpr double pipes = 4, pipes_of_both = 4;
#endif
  // Programs beside this one, and a change of the clock, may make either measurement a little slower.
  const double most = 1.15 * machine.at("cycles_per_second").get<double>();
  for (const auto& rate : machine.at("vectors")) {
    EXPECT_LT(rate.at("multiply_adds_per_second"), pipes * most) << machine;
    EXPECT_LT(rate.at("adds_per_second"), pipes * most) << machine;
    EXPECT_LT(rate.at("both_per_second"), pipes_of_both * most) << machine;
  }
}

/// All instruction sets with fused multiply-adds give the same bits.
TEST_F(Benchmark, KernelsOfAllWidthsEndAtTheSameBits) {
  const Outcome outcome = measure("--quick --json --only kernels --kernels AVX");
  if (outcome.error.find("no kernel") != std::string::npos) GTEST_SKIP() << "this processor has no AVX2";
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto results = nlohmann::json::parse(outcome.out);
  for (const auto& measurement : results.at("kernels").at("measurements"))
    for (const auto& row : measurement.at("kernels"))
      EXPECT_EQ(row.at("ends"), measurement.at("kernels")[0].at("ends")) << measurement.at("name") << row;
}

TEST_F(Benchmark, WholeJobsSayWhatTheyTookByPhase) {
  const Outcome outcome = measure("--quick --json --only jobs");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto jobs = nlohmann::json::parse(outcome.out).at("jobs");
  ASSERT_GE(jobs.at("renders").size(), 3u);
  for (const auto& job : jobs.at("renders")) {
    EXPECT_GT(job.at("rays"), 0) << job;
    EXPECT_GT(job.at("seconds").at("total"), 0) << job;
  }
  // Both samplers of the field emit the same photons.
  const auto& positions = jobs.at("box_sampler").at("positions");
  EXPECT_EQ(positions[0], positions[1]);
}

TEST_F(Benchmark, CheckpointsHaveACost) {
  const Outcome outcome = measure("--quick --json --only keeping");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto keeping = nlohmann::json::parse(outcome.out).at("keeping");
  ASSERT_EQ(keeping.at("checkpoints").size(), 2u);
  for (const auto& job : keeping.at("checkpoints")) EXPECT_GT(job.at("seconds"), 0) << job;
}

TEST_F(Benchmark, CausticsHaveErrorsAndTimes) {
  const Outcome outcome = measure("--quick --json --only caustics");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto caustics = nlohmann::json::parse(outcome.out).at("caustics");
  ASSERT_EQ(caustics.size(), 1u);
  for (const auto& row : caustics[0].at("rows")) {
    EXPECT_GT(row.at("error"), 0) << row;
    EXPECT_GT(row.at("seconds"), 0) << row;
  }
  EXPECT_LT(caustics[0].at("rows")[0].at("error"), 0.2);
}

TEST_F(Benchmark, ALiveViewHasAFirstAndAFinishedPicture) {
  const Outcome outcome = measure("--quick --json --only view");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  const auto view = nlohmann::json::parse(outcome.out).at("view");
  ASSERT_EQ(view.size(), 1u);
  EXPECT_GT(view[0].at("first_picture"), 0);
  EXPECT_GT(view[0].at("final_picture"), 0);
  EXPECT_GT(view[0].at("phases").at("trace"), 0);
}

TEST_F(Benchmark, TablesNameEveryPart) {
  const Outcome outcome = measure("--quick --only loading");
  ASSERT_EQ(outcome.status, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("GB/s"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("from file to bricks"), std::string::npos) << outcome.out;
}

TEST_F(Benchmark, UnknownPartsAreRefusedInALine) {
  const Outcome outcome = measure("--only nothing");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
}

}  // namespace
}  // namespace tensorray::test
