#include "volumes/bricks/brick_memory.h"

#include <utility>

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

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

}  // namespace tensorray
