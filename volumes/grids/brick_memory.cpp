#include "volumes/grids/brick_memory.h"

#include <atomic>
#include <stdexcept>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// Number of blocks that a thread places in a row.
constexpr std::size_t grain = 16;

std::shared_ptr<float[]> owned_pages(void* pages, std::size_t bytes) {
  return {static_cast<float*>(pages), [bytes](float* floats) { unmap_pages(floats, bytes); }};
}

}  // namespace

BrickMemory make_bricks(std::size_t count, int stored_floats, int components) {
  BrickMemory bricks;
  bricks.count = count;
  bricks.stride = static_cast<std::size_t>(stored_floats);
  bricks.components = components;
  Descriptor file;
  bricks.floats = owned_pages(map_pages(bricks.bytes(), &file), bricks.bytes());
  if (file.is_open()) bricks.file = std::make_shared<const Descriptor>(std::move(file));
  return bricks;
}

BrickMemory bricks_of_file(Descriptor file, std::size_t count, std::size_t stride, int components) {
  BrickMemory bricks{{}, count, stride, components, std::make_shared<const Descriptor>(std::move(file))};
  bricks.floats = owned_pages(map_file(*bricks.file, bricks.bytes()), bricks.bytes());
  return bricks;
}

void keep_bricks(BrickMemory& bricks, std::size_t count) {
  release_pages(bricks.brick(count), (bricks.count - count) * bricks.stride * sizeof(float));
  bricks.count = count;
}

BrickMemory place_blocks(
    const BlockSource& source, const std::function<BrickMemory(bool symmetric)>& make,
    const std::function<bool(std::size_t i, const TensorBlock& block, const BrickMemory& blocks)>& place) {
  for (const bool symmetric : {true, false}) {
    const BrickMemory blocks = make(symmetric);
    std::atomic<bool> fits{true};
    const tbb::blocked_range<std::size_t> all(0, source.shapes.size(), grain);
    tbb::parallel_for(all, [&](const tbb::blocked_range<std::size_t>& range) {
      TensorBlock block;
      for (std::size_t i = range.begin(); i < range.end() && fits; ++i) {
        read_block(source, i, block);
        if (!place(i, block, blocks)) fits = false;
      }
    });
    if (fits) return blocks;
  }
  throw std::logic_error("a block has no place");  // Any tensors fit the second time.
}

}  // namespace tensorray
