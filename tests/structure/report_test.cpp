// tests/report.awk, which makes the report of tools/test: a list of tests by name, from the output of GoogleTest
// and ctest.

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/data_folder.h"

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

  /// Runs the report on the log, expected.txt and the given results. @return Its output.
  std::string report(const std::string& results = "") {
    const std::string command = "cd '" + folder_.string() + "' && awk -f '" +
                                (test::source_folder() / "tests" / "report.awk").string() +
                                "' LastTest.log expected.txt " + results;
    FILE* const pipe = popen(command.c_str(), "r");
    std::string text;
    std::array<char, 4096> buffer;
    while (const std::size_t size = fread(buffer.data(), 1, buffer.size(), pipe)) text.append(buffer.data(), size);
    status_ = WEXITSTATUS(pclose(pipe));
    return text;
  }

  int status_ = -1;  ///< Exit status of the last report.

 private:
  std::filesystem::path folder_;
};

TEST_F(Report, CountsTestsOfAllProcesses) {
  write("LastTest.log", in_log("base.0", "", true) + in_log("base.1", "", true));
  write("base.0.xml", results_of(test_case("A", "completed") + test_case("B/0", "completed")));
  write("base.1.xml", results_of(test_case("C", "completed")));
  EXPECT_EQ(report("base.0.xml base.1.xml"), "\n3 passed, 0 failed, 0 skipped\n");
  EXPECT_EQ(status_, 0);
}

TEST_F(Report, FailedTestsComeWithTheirOutput) {
  write("LastTest.log", in_log("base.0",
                               "[ RUN      ] Suite.A\n[       OK ] Suite.A (0 ms)\n"
                               "[ RUN      ] Suite.B\nprinted a.cpp:1: Failure\n[  FAILED  ] Suite.B (0 ms)\n",
                               false));
  write("base.0.xml",
        results_of(test_case("A", "completed") + test_case("B", "completed", "      <failure message=\"x\"/>\n")));
  EXPECT_EQ(
      report("base.0.xml"),
      "\n== base.Suite.B\n  printed a.cpp:1: Failure\n\n== failed:\nbase.Suite.B\n\n1 passed, 1 failed, 0 skipped\n");
  EXPECT_EQ(status_, 1);
}

TEST_F(Report, SkippedTestsComeWithTheirReasons) {
  write("LastTest.log", in_log("base.0", "", true));
  write("base.0.xml", results_of(test_case(
                          "A", "skipped",
                          "      <skipped message=\"/a/b.cpp:11&#x0A;no &quot;x&quot; &amp; &lt;y&gt;&#x0A;z\"/>\n")));
  EXPECT_EQ(report("base.0.xml"), "\n== skipped:\nbase.Suite.A: no \"x\" & <y> z\n\n0 passed, 0 failed, 1 skipped\n");
  EXPECT_EQ(status_, 0);
}

TEST_F(Report, CrashesFailTheTestThatRanAndThoseThatDidNotRun) {
  write("LastTest.log", in_log("base.0",
                               "[ RUN      ] Suite.A\n[       OK ] Suite.A (0 ms)\n"
                               "[ RUN      ] Suite.S\n/a/b.cpp:11: Skipped\nno x\n[  SKIPPED ] Suite.S (0 ms)\n"
                               "[ RUN      ] Suite.B\nlast words\n",
                               false));
  write("expected.txt", "base.Suite.A\nbase.Suite.B\nbase.Suite.C\nbase.Suite.S\n");
  EXPECT_EQ(report(),
            "\n== base.Suite.B\n  last words\n  its process crashed, or was stopped after its time\n"
            "\n== base.Suite.C\n  not run: its process ended in a test before it\n"
            "\n== failed:\nbase.Suite.B\nbase.Suite.C\n\n== skipped:\nbase.Suite.S: no x\n"
            "\n1 passed, 2 failed, 1 skipped\n");
  EXPECT_EQ(status_, 1);
}

TEST_F(Report, ProcessesMayFailBeforeTheirFirstTestAndAfterTheirLast) {
  write("LastTest.log", in_log("base.0", "cannot load\n", false) + in_log("base.1", "leak\n", false));
  write("base.1.xml", results_of(test_case("A", "completed")));
  const std::string text = report("base.1.xml");
  EXPECT_NE(text.find("base.0 (could not start)\nbase.1 (after its last test)\n\n1 passed, 2 failed, 0 skipped\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("cannot load"), std::string::npos) << text;
  EXPECT_NE(text.find("leak"), std::string::npos) << text;
  EXPECT_EQ(status_, 1);
}

TEST_F(Report, NoTestIsAFailure) {
  write("LastTest.log", in_log("base.0", "", true));
  write("base.0.xml", results_of(""));
  EXPECT_EQ(report("base.0.xml"), "no test ran\n\n0 passed, 0 failed, 0 skipped\n");
  EXPECT_EQ(status_, 1);
}

}  // namespace
}  // namespace tensorray
