#include "volumes/grids/block_memory.h"

#include <array>
#include <deque>
#include <fstream>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include "tests/thread_sanitizer.h"

namespace tensorray {
namespace {

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

Deque make(int first, int count) {
  Deque numbers;
  for (int i = first; i < first + count; ++i) {
    numbers.emplace_back().number = i;
    numbers.back().filling[4599] = -i;
  }
  return numbers;
}

/// Memory of the process, bytes.
double resident_bytes() {
  double pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

TEST(BlockMemory, HoldsWhatADequeDoesToIt) {
  tbb::parallel_for(0, 4, [](int thread) {
    const int first = 10000 * thread;
    Deque numbers = make(first, 1000);  // More than a slab.
    const Deque copy = numbers;
    for (int i = 0; i < 300; ++i) numbers.pop_front();
    numbers.erase(numbers.end() - 50, numbers.end());
    expect_numbers(numbers, first + 300);
    for (int i = first + 950; i < first + 1200; ++i) {
      numbers.emplace_back().number = i;
      numbers.back().filling[4599] = -i;
    }
    expect_numbers(numbers, first + 300);
    expect_numbers(copy, first);
    numbers = copy;
    expect_numbers(numbers, first);
  });
}

TEST(BlockMemory, IsGivenBackWhileTheRestIsUsed) {
  if (test::has_thread_sanitizer) GTEST_SKIP() << "the sanitizer's own memory is larger";
  constexpr double slab = 1 << 23;
  const double before = resident_bytes();
  Deque numbers = make(0, 5000);
  EXPECT_GT(resident_bytes() - before, 5000 * sizeof(Large) - slab);
  for (int i = 0; i < 4500; ++i) numbers.pop_front();
  EXPECT_LT(resident_bytes() - before, 500 * sizeof(Large) + 3 * slab);
  expect_numbers(numbers, 4500);
}

}  // namespace
}  // namespace tensorray
