#include "volumes/grids/brick_memory.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// Number of blocks that are placed before all threads wait; enough to keep them busy.
constexpr std::size_t part_size = 4096;

/// Number of blocks that a thread places in a row. Neighbours along z share bricks.
constexpr std::size_t grain = 16;

std::shared_ptr<float[]> owned_pages(void* pages, std::size_t bytes) {
  return {static_cast<float*>(pages), [bytes](float* floats) { unmap_pages(floats, bytes); }};
}

/// The same bricks with tensors of any kind. `keep`: with the tensors that they hold.
BrickMemory widened(const BrickMemory& narrow, const BlockPlaces& places, bool keep) {
  BrickMemory wide = places.make(false);
  if (keep) for_blocks(narrow.count, [&](std::size_t i) { places.widen(narrow.brick(i), wide.brick(i)); });
  return wide;
}

}  // namespace

BrickMemory make_bricks(std::size_t count, int stored_floats, int components) {
  BrickMemory bricks;
  bricks.count = count;
  bricks.stride = static_cast<std::size_t>(stored_floats);
  bricks.components = components;
  constexpr std::size_t alignment = 4096;
  const std::size_t bytes = bricks.bytes();
  if (memory_bound()) {
    bricks.file = std::make_shared<const Descriptor>(make_page_file(bytes));
    bricks.floats = owned_pages(map_page_file(*bricks.file, bytes, true), bytes);
  } else {
    bricks.floats = owned_pages(map_pages(bytes, alignment), bytes);
  }
  expect_first_writes(bricks.floats.get(), bytes, true);
  return bricks;
}

BrickMemory bricks_of_file(Descriptor file, std::size_t count, std::size_t stride, int components) {
  BrickMemory bricks{{}, count, stride, components, std::make_shared<const Descriptor>(std::move(file))};
  bricks.floats = owned_pages(map_page_file(*bricks.file, bricks.bytes(), false), bricks.bytes());
  return bricks;
}

void keep_bricks(BrickMemory& bricks, std::size_t count) {
  release_pages(bricks.brick(count), (bricks.count - count) * bricks.stride * sizeof(float));
  bricks.count = count;
}

BrickMemory place_blocks(const BlockSource& source, const BlockPlaces& places) {
  BrickMemory bricks = places.make(true);
  std::atomic<bool> fits{true};
  const auto place_part = [&](const tbb::blocked_range<std::size_t>& range) {
    TensorBlock block;
    for (std::size_t i = range.begin(); i < range.end() && fits; ++i) {
      read_block(source, i, block);
      if (!places.place(i, block, bricks)) fits = false;
    }
  };
  const std::size_t count = source.shapes.size();
  for (std::size_t first = 0; first < count; first += part_size) {
    const tbb::blocked_range<std::size_t> part(first, std::min(first + part_size, count), grain);
    tbb::parallel_for(part, place_part);
    if (fits) continue;
    bricks = widened(bricks, places, first > 0);
    fits = true;
    tbb::parallel_for(part, place_part);  // It was not placed whole.
  }
  expect_first_writes(bricks.floats.get(), bricks.bytes(), false);
  return bricks;
}

}  // namespace tensorray
