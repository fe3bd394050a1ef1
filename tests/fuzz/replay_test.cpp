// Bytes that broke a parser once, and some that are right (corpus/): none may end the process, or throw what is no
// error of a reader. Beside each, what its cut-off beginnings give.

#include "tests/data_folder.h"
#include "tests/files.h"
#include "tests/fuzz/targets.h"

namespace tensorray::test {
namespace {

std::filesystem::path corpus() { return source_folder() / "tests" / "fuzz" / "corpus"; }

class Replay : public ::testing::TestWithParam<std::size_t> {};

/// A fuzzer that has no accepted bytes to begin with sees little of its parser.
TEST_P(Replay, NoBytesBreakAParserWhichAcceptsSomeOfThem) {
  const FuzzTarget& target = fuzz_targets()[GetParam()];
  std::size_t accepted = 0;
  for (const auto& entry : std::filesystem::directory_iterator(corpus() / target.name)) {
    const std::string bytes = bytes_of(entry.path());
    EXPECT_NO_THROW(accepted += target.read(bytes) ? 1 : 0) << entry.path();
    constexpr std::size_t cuts = 64;
    for (std::size_t i = 0; i < cuts; ++i)
      EXPECT_NO_THROW(target.read(bytes.substr(0, bytes.size() * i / cuts))) << entry.path() << " " << i;
  }
  EXPECT_GT(accepted, 0u) << target.name;
}

INSTANTIATE_TEST_SUITE_P(Targets, Replay, ::testing::Range(std::size_t{0}, fuzz_targets().size()),
                         [](const auto& test) { return std::string(fuzz_targets()[test.param].name); });

}  // namespace
}  // namespace tensorray::test
