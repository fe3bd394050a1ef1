// Too few threads and too little memory: what is said, and that estimates are near what is needed.

#include <cmath>

#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

class Limits : public Program {
 protected:
  void SetUp() override {
#ifdef TENSORRAY_SANITIZED
    GTEST_SKIP() << "the address sanitizer needs terabytes of addresses";
#endif
    Program::SetUp();
    write("scene.json", small_scene());
  }

  /// Without further threads: a limit that does not bind root. Another user may not see the program's folder, or this
  /// one, but for a capability.
  static std::string without_threads() {
    const std::string user = geteuid() != 0 ? ""
                                            : "setpriv --reuid=65534 --regid=65534 --clear-groups "
                                              "--inh-caps=+dac_override --ambient-caps=+dac_override ";
    return "exec " + user + "prlimit --nproc=1";
  }

  Outcome run_in(const std::string& shell, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"render", "scene.json", "-q", "-o", "a.png"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return wait_for(start_in(shell, arguments));
  }
};

TEST_F(Limits, AreSaidInOneLine) {
  struct Case {
    std::string shell;
    std::vector<std::string> more;
    int status;
    const char* line;
  };
  const std::string little = "ulimit -v 3000000; exec";
  const std::vector<Case> cases{
      {without_threads(), {}, 1, "Resource temporarily unavailable"},
      {little, {"--set", "receiver.resolution=[16000,16000]"}, 2, "`/receiver/resolution` needs about"},
      {little, {"--set", "integrator.type=lens", "--set", "receiver.resolution=[8000,8000]"}, 2, "ulimit -v"},
      {little, {"--set", "integrator.type=path_tracing", "--set", "camera.resolution=[6000,6000]"}, 2, "needs about"},
      {little, {"--set", "integrator.type=scene", "--set", "camera.resolution=[6000,6000]"}, 2, "needs about"},
      {little, {"--set", "field.generate.resolution=600"}, 2, "resolution: the voxels need about"},
      {"ulimit -v 200000; exec", {"--threads", "2"}, 1, "threads can be started"}};
  for (const Case& each : cases) {
    const Outcome outcome = run_in(each.shell, each.more);
    EXPECT_EQ(outcome.status, each.status) << each.shell << outcome.error;
    EXPECT_EQ(outcome.error.rfind("tensorray: ", 0), 0u) << outcome.error;
    EXPECT_NE(outcome.error.find(each.line), std::string::npos) << each.line << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_FALSE(std::filesystem::exists(in_folder("a.png")));
  }
}

TEST_F(Limits, OfProcessorsAreThoseOfTheRun) {
  for (const auto& [shell, more, threads] :
       {std::tuple{"exec taskset 1", std::vector<std::string>{"--threads", "4"}, 1},
        std::tuple{"exec", std::vector<std::string>{"--threads", "1"}, 1}}) {
    std::vector<std::string> arguments = more;
    arguments.insert(arguments.end(), {"--stats", "stats.json"});
    const Outcome outcome = run_in(shell, arguments);
    ASSERT_EQ(outcome.status, 0) << outcome.error;
    EXPECT_EQ(read_json("stats.json")["threads"], threads) << shell;
  }
}

/// "needs about 1.5 GiB", in bytes.
double needed_bytes(const std::string& error) {
  const std::string words = "needs about ";
  const std::size_t at = error.find(words);
  if (at == std::string::npos) return NAN;
  std::istringstream text(error.substr(at + words.size()));
  double number = 0;
  std::string unit;
  text >> number >> unit;
  return number * (unit.rfind("GiB", 0) == 0 ? std::exp2(30) : unit.rfind("MiB", 0) == 0 ? std::exp2(20) : NAN);
}

/// What a larger picture needs more than a smaller one: as it is estimated, and as it is measured.
TEST_F(Limits, EstimatesOfMemoryAreNearWhatIsMeasured) {
  struct Case {
    std::vector<std::string> more;
    const char* key;
    int small, large;
  };
  const std::vector<std::string> paths{"--set", "integrator.type=path_tracing", "--set", "integrator.max_samples=1",
                                       "--set", "integrator.min_samples=1",     "--set", "integrator.seeds.count=10"},
      histogram{"--set", R"(integrator.density={"kind":"histogram"})"};
  for (const Case& each :
       {Case{histogram, "receiver.resolution", 1500, 3000}, Case{paths, "camera.resolution", 300, 1000}}) {
    double estimate[2], measured[2];
    for (const int i : {0, 1}) {
      const int size = i == 0 ? each.small : each.large;
      std::vector<std::string> arguments = each.more;
      arguments.insert(arguments.end(), {"--set", std::string(each.key) + "=[" + std::to_string(size) + "," +
                                                      std::to_string(size) + "]"});
      estimate[i] = needed_bytes(run_in("ulimit -d 120000; exec", arguments).error);
      arguments.insert(arguments.end(), {"--stats", "stats.json"});
      const Outcome outcome = run_in("exec", arguments);
      ASSERT_EQ(outcome.status, 0) << outcome.error;
      measured[i] = read_json("stats.json")["peak_memory_bytes"];
    }
    EXPECT_NEAR((estimate[1] - estimate[0]) / (measured[1] - measured[0]), 1, 1.0 / 3) << each.more[1];
  }
}

}  // namespace
}  // namespace tensorray
