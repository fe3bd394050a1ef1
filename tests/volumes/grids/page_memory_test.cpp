// The bound of resident memory, step by step: after each step that waits for room, there is some.

#include "volumes/grids/page_memory.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "tests/thread_sanitizer.h"

namespace tensorray {
namespace {

constexpr std::size_t times = test::has_thread_sanitizer ? 16 : 1;  // Its bytes are beside the field.
constexpr std::size_t bound = times * (std::size_t{256} << 20), piece = std::size_t{4} << 20, pieces = 200;

/// With sanitizers, whose own memory would count, 0: then only the bytes of pages are tested.
std::size_t resident_bytes() {
#ifdef TENSORRAY_SANITIZED
  return 0;
#else
  std::size_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
#endif
}

char content_of(std::size_t i) { return static_cast<char>(i % 251 + 1); }

/// Writes pieces of three times the usual bound, and reads them again. @return what went wrong; empty: nothing.
std::string use_pages(const std::filesystem::path& folder) {
  bound_memory(bound, folder);
  std::vector<char*> memory;
  for (std::size_t i = 0; i < pieces; ++i) {
    make_room();
    if (resident_bytes() > bound) return "writing: " + std::to_string(resident_bytes());
    memory.push_back(static_cast<char*>(map_pages(piece, 4096)));
    std::fill_n(memory.back(), piece, content_of(i));
  }
  for (std::size_t i = 0; i < pieces; ++i) {
    make_room();
    if (resident_bytes() > bound) return "reading: " + std::to_string(resident_bytes());
    for (const std::size_t at : {std::size_t{0}, piece / 2, piece - 1})
      if (memory[i][at] != content_of(i)) return "a page has lost its bytes";
  }
  for (char* each : memory) unmap_pages(each, piece);
  return "";
}

/// In a new process, as the bound stays, and as what other tests have in memory would count.
TEST(PageMemory, StaysBelowItsBoundAndKeepsAllBytes) {
  const TemporaryFolder folder;
  if (std::filesystem::space(folder / "").available < (std::uintmax_t{2} << 30))
    GTEST_SKIP() << "the test needs 2 GB in " << folder / "";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto use = [] {
    const TemporaryFolder pages;
    std::cerr << "[" << use_pages(pages / "") << "]";
  };
  EXPECT_EXIT((use(), _exit(0)), ::testing::ExitedWithCode(0), R"(\[\])");
}

}  // namespace
}  // namespace tensorray
