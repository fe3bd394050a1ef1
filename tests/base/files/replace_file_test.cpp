#include <csignal>
#include <fstream>
#include <iterator>

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "base/files/output_file.h"
#include "base/text/content_hash.h"

namespace tensorray {
namespace {

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(ReplaceFileTest, WritesAllOrNothing) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "replace_file";
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "a";
  replace_file(file, {"one ", "two"});
  EXPECT_EQ(content_of(file), "one two");
  std::ofstream(folder / "a.new") << "somebody's";
  const std::filesystem::path beside =
      folder / fmt::format(".tensorray-{:016x}.new", content_hash(file.filename().string()));
  std::ofstream(beside) << "what a killed process left, which is longer than the next";
  replace_file(file, {"three"});
  EXPECT_EQ(content_of(file), "three");
  EXPECT_EQ(content_of(folder / "a.new"), "somebody's");
  EXPECT_FALSE(std::filesystem::exists(beside));
  std::filesystem::create_symlink("a.new", beside);
  EXPECT_THROW(replace_file(file, {"four"}), std::runtime_error);
  EXPECT_EQ(content_of(folder / "a.new"), "somebody's");
  EXPECT_THROW(replace_file(folder / "none" / "a", {"x"}), std::runtime_error);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit none{0, before.rlim_max};  // Imitates a full disk.
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &none);
  EXPECT_THROW(replace_file(folder / "full", {"x"}), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(std::filesystem::exists(folder / "full"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tensorray
