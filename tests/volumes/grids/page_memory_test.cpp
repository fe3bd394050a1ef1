// Arrays in files: they keep their bytes, take no memory of the process's own, and leave nothing behind.

#include "volumes/grids/page_memory.h"

#include <array>
#include <deque>
#include <fstream>
#include <iostream>

#include <tbb/parallel_for.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "tests/files.h"

namespace tensorray {
namespace {

#ifdef __has_feature  // Clang, which the preset `tsan` uses.
constexpr bool has_thread_sanitizer = __has_feature(thread_sanitizer);
#else
constexpr bool has_thread_sanitizer = false;
#endif

constexpr std::size_t large = std::size_t{64} << 20;

/// Memory of the process that is not a file's, bytes.
std::size_t own_bytes() {
  std::size_t all = 0, resident = 0, shared = 0;
  std::ifstream("/proc/self/statm") >> all >> resident >> shared;
  return (resident - shared) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

using Bytes = std::vector<char, PageAllocator<char>>;

char content_of(std::size_t i) { return static_cast<char>(i / 4096 % 251 + 1); }

/// @return what went wrong; empty: nothing.
std::string use_files(const std::filesystem::path& folder) {
  bound_memory(large, folder);
  const std::size_t before = own_bytes();
  Bytes bytes(large);
  for (std::size_t i = 0; i < large; ++i) bytes[i] = content_of(i);
  const Bytes copy = bytes;
  release_pages(bytes.data() + large / 2, large / 2);
  for (std::size_t i = 0; i < large; ++i)
    if (copy[i] != content_of(i) || (i < large / 2 && bytes[i] != copy[i])) return "a byte is lost";
#ifndef TENSORRAY_SANITIZED
  if (own_bytes() > before + large / 4) return "memory of its own: " + std::to_string(own_bytes() - before);
#endif
  if (!std::filesystem::is_empty(folder)) return "the folder has a file";
  const FileSizeLimit full(large / 2);
  try {
    const Bytes more(large);
    return "a full disk is not noticed";
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    const bool is_line = text.find('\n') == std::string::npos;
    return is_line && text.find("--memory: " + folder.string()) == 0 ? "" : text;
  }
}

/// In a new process, as the bound stays.
TEST(PageMemory, WithABoundIsThatOfFilesWithoutNames) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto use = [] {
    const TemporaryFolder folder;
    std::cerr << "[" << use_files(folder / "") << "]";
  };
  EXPECT_EXIT((use(), _exit(0)), ::testing::ExitedWithCode(0), R"(\[\])");
}

/// An element as large as a block of tensors.
struct Large {
  int number = 0;
  std::array<int, 4600> filling{};
};

using Deque = std::deque<Large, SlotAllocator<Large>>;

void expect_numbers(const Deque& numbers, int first) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    ASSERT_EQ(numbers[i].number, first + static_cast<int>(i));
    ASSERT_EQ(numbers[i].filling[4599], -first - static_cast<int>(i));
  }
}

void append(Deque& numbers, int first, int end) {
  for (int i = first; i < end; ++i) {
    numbers.emplace_back().number = i;
    numbers.back().filling[4599] = -i;
  }
}

TEST(SlotMemory, HoldsWhatADequeDoesToIt) {
  tbb::parallel_for(0, 4, [](int thread) {
    const int first = 10000 * thread;
    Deque numbers;
    append(numbers, first, first + 1000);  // More than a slab.
    const Deque copy = numbers;
    for (int i = 0; i < 300; ++i) numbers.pop_front();
    numbers.erase(numbers.end() - 50, numbers.end());
    expect_numbers(numbers, first + 300);
    append(numbers, first + 950, first + 1200);
    expect_numbers(numbers, first + 300);
    expect_numbers(copy, first);
    numbers = copy;
    expect_numbers(numbers, first);
  });
}

TEST(SlotMemory, IsGivenBackWhileTheRestIsUsed) {
  if (has_thread_sanitizer) GTEST_SKIP() << "the sanitizer's own memory is larger";
  constexpr double slab = 1 << 23;
  const auto before = static_cast<double>(own_bytes());
  Deque numbers;
  append(numbers, 0, 5000);
  EXPECT_GT(static_cast<double>(own_bytes()) - before, 5000 * sizeof(Large) - slab);
  for (int i = 0; i < 4500; ++i) numbers.pop_front();
  EXPECT_LT(static_cast<double>(own_bytes()) - before, 500 * sizeof(Large) + 3 * slab);
  expect_numbers(numbers, 4500);
}

}  // namespace
}  // namespace tensorray
