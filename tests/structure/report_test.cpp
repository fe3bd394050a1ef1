// tests/report.awk, which makes the report of tools/test: a list of tests by name, from the output of GoogleTest
// and ctest.

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/structure/commands.h"

namespace tensorray {
namespace {

/// A shard in the log of ctest: the output of its process, and whether it passed.
std::string in_log(const std::string& shard, const std::string& output, bool passed) {
  return "1/1 Testing: " + shard + "\n1/1 Test: " + shard + "\nOutput:\n" + output +
         "<end of output>\nTest time = 1\n" + (passed ? "Test Passed.\n" : "Test Failed.\n");
}

std::string results_of(const std::string& cases) {
  return "<?xml version=\"1.0\"?>\n<testsuites tests=\"1\" name=\"AllTests\">\n" + cases + "</testsuites>\n";
}

std::string test_case(const std::string& name, const std::string& result, const std::string& inside = "") {
  return "    <testcase name=\"" + name + "\" value_param=\"&quot;a b&quot;\" status=\"run\" result=\"" + result +
         "\" classname=\"Suite\" >\n" + inside + "    </testcase>\n";
}

class Report : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("tensorray_report_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    write("expected.txt", "");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }

  /// The report on the log, expected.txt and the given results.
  test::CommandResult report(const std::string& results) const {
    const std::string program = (test::source_folder() / "tests" / "report.awk").string();
    return test::run_command("cd '" + folder_.string() + "' && awk -f '" + program + "' LastTest.log expected.txt " +
                             results);
  }

 private:
  std::filesystem::path folder_;
};

/// Processes that ended: passed tests, a failed one with its output, a skipped one with its reason.
TEST_F(Report, NamesTestsThatFailedOrWereSkipped) {
  write("LastTest.log", in_log("base.0",
                               "[ RUN      ] Suite.A\n[       OK ] Suite.A (0 ms)\n"
                               "[ RUN      ] Suite.B\nprinted a.cpp:1: Failure\n[  FAILED  ] Suite.B (0 ms)\n",
                               false) +
                            in_log("base.1", "", true));
  write("base.0.xml",
        results_of(test_case("A", "completed") + test_case("B", "completed", "      <failure message=\"x\"/>\n")));
  write(
      "base.1.xml",
      results_of(test_case("C/0", "completed") +
                 test_case("D", "skipped",
                           "      <skipped message=\"/a/b.cpp:11&#x0A;no &quot;x&quot; &amp; &lt;y&gt;&#x0A;z\"/>\n")));
  const auto [text, status] = report("base.0.xml base.1.xml");
  EXPECT_EQ(text,
            "\n== base.Suite.B\n  printed a.cpp:1: Failure\n\n== failed:\nbase.Suite.B\n"
            "\n== skipped:\nbase.Suite.D: no \"x\" & <y> z\n\n2 passed, 1 failed, 1 skipped\n");
  EXPECT_EQ(status, 1);
}

/// A process that crashed, one that could not start, and one that failed after its last test.
TEST_F(Report, NamesTestsOfProcessesThatFailed) {
  write("LastTest.log", in_log("base.0",
                               "[ RUN      ] Suite.A\n[       OK ] Suite.A (0 ms)\n"
                               "[ RUN      ] Suite.S\n/a/b.cpp:11: Skipped\nno x\n[  SKIPPED ] Suite.S (0 ms)\n"
                               "[ RUN      ] Suite.B\nlast words\n",
                               false) +
                            in_log("base.1", "cannot load\n", false) + in_log("base.2", "leak\n", false));
  write("expected.txt", "base.Suite.A\nbase.Suite.B\nbase.Suite.C\nbase.Suite.S\n");
  write("base.2.xml", results_of(test_case("D", "completed")));
  const auto [text, status] = report("base.2.xml");
  for (const char* part : {"\n== base.Suite.B\n  last words\n  its process crashed, or was stopped after its time\n",
                           "\n== base.Suite.C\n  not run: its process ended in a test before it\n", "cannot load",
                           "leak", "base.1 (could not start)", "base.2 (after its last test)\n",
                           "\n== skipped:\nbase.Suite.S: no x\n\n2 passed, 4 failed, 1 skipped\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nis missing in " << text;
  EXPECT_EQ(status, 1);
}

TEST_F(Report, StatusIsZeroOnlyIfATestPassed) {
  write("LastTest.log", in_log("base.0", "", true));
  write("base.0.xml", results_of(test_case("A", "completed")));
  EXPECT_EQ(report("base.0.xml").status, 0);
  write("base.0.xml", results_of(""));
  const auto [text, status] = report("base.0.xml");
  EXPECT_EQ(text, "no test ran\n\n0 passed, 0 failed, 0 skipped\n");
  EXPECT_EQ(status, 1);
}

}  // namespace
}  // namespace tensorray
