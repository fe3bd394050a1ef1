// `tensorray_bench` answers its questions, and says how the ways of a case compare.

#include <string>

#include "tests/program/support.h"

namespace tensorray::test {
namespace {

TEST_F(Program, TheBenchmarkPrintsRatesAndRatios) {
  const auto benchmark = std::filesystem::path(TENSORRAY_BINARY).replace_filename("tensorray_bench");
  const std::string out = in_folder("out").string();
  const auto measure = [&](const std::string& options) {
    const int status = std::system(("'" + benchmark.string() + "' " + options + " > '" + out + "' 2>&1").c_str());
    EXPECT_EQ(status, 0) << read_file(out);
    return read_file(out);
  };
  const std::string questions = measure("--benchmark_list_tests");
  for (const char* const question : {"rays/", "pictures/", "caustics/", "loading/", "view/"})
    EXPECT_NE(questions.find(question), std::string::npos) << question;

  const std::string rates = measure("--benchmark_filter='^loading/64' --benchmark_min_time=0.001");
  for (const char* const word : {"processor: ", "loading/64_voxels/vdb", "ratio=1"})
    EXPECT_NE(rates.find(word), std::string::npos) << rates;
}

}  // namespace
}  // namespace tensorray::test
