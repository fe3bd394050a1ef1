#include "volumes/grids/block_memory.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

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

/// Memory of the process, megabytes.
double resident_megabytes() {
  std::ifstream file("/proc/self/statm");
  double pages = 0;
  file >> pages >> pages;
  return pages * 4096 / 1e6;
}

TEST(BlockMemory, HoldsWhatADequeDoesToIt) {
  Deque numbers = make(0, 700);  // More than six slabs.
  expect_numbers(numbers, 0);
  const Deque copy = numbers;
  for (int i = 0; i < 300; ++i) numbers.pop_front();
  numbers.erase(numbers.end() - 50, numbers.end());
  expect_numbers(numbers, 300);
  for (int i = 650; i < 900; ++i) {
    numbers.emplace_back().number = i;
    numbers.back().filling[4599] = -i;
  }
  expect_numbers(numbers, 300);
  expect_numbers(copy, 0);
  numbers = copy;
  expect_numbers(numbers, 0);
}

TEST(BlockMemory, IsGivenBackWhileTheRestIsUsed) {
  if (test::has_thread_sanitizer) GTEST_SKIP() << "the sanitizer's own memory is larger";
  const double before = resident_megabytes();
  Deque numbers = make(0, 5000);
  const double all = resident_megabytes();
  EXPECT_GT(all - before, 5000 * sizeof(Large) / 1e6 - 4);
  for (int i = 0; i < 4500; ++i) numbers.pop_front();
  EXPECT_LT(resident_megabytes() - before, 500 * sizeof(Large) / 1e6 + 8);
  expect_numbers(numbers, 4500);
}

TEST(BlockMemory, PreparedMemoryIsUsedFirst) {
  if (test::has_thread_sanitizer) GTEST_SKIP() << "the sanitizer's own memory is larger";
  SlotAllocator<Large>::prepare(5000);
  const double before = resident_megabytes();
  const Deque numbers = make(0, 4000);
  EXPECT_LT(resident_megabytes() - before, 4500 * sizeof(Large) / 1e6);
  expect_numbers(numbers, 0);
}

TEST(BlockMemory, MayBeSharedByThreads) {
  tbb::parallel_for(0, 16, [](int i) {
    for (int turn = 0; turn < 5; ++turn) {
      Deque numbers = make(1000 * i, 150);
      for (int k = 0; k < 20; ++k) numbers.pop_front();
      expect_numbers(numbers, 1000 * i + 20);
    }
  });
}

TEST(BlockMemory, SlotsLieApartAndAreAligned) {
  SlotPool pool(sizeof(Large) / 16 * 16 + 16);
  std::vector<char*> slots;
  for (int i = 0; i < 500; ++i) slots.push_back(static_cast<char*>(pool.take()));
  std::sort(slots.begin(), slots.end());
  for (std::size_t i = 0; i < slots.size(); ++i) {
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(slots[i]) % 16, 0u);
    if (i > 0) {
      EXPECT_GE(slots[i] - slots[i - 1], static_cast<std::ptrdiff_t>(sizeof(Large)));
    }
  }
  for (char* slot : slots) pool.give_back(slot);
}

}  // namespace
}  // namespace tensorray
