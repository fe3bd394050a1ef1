#pragma once
/// @file volumes/grids/brick_memory.h
/// Memory for the bricks of a field, and for blocks of voxels on their way to these.

#include <cstddef>
#include <functional>
#include <memory>

#include "base/files/descriptor.h"
#include "volumes/grids/block_source.h"

namespace tensorray {

/// Bricks of one layout, in pages (page_memory.h). Copies share them.
struct BrickMemory {
  std::shared_ptr<float[]> floats;
  std::size_t count = 0, stride = 0;       ///< Number of bricks; floats of one.
  int components = 0;                      ///< Stored of each tensor beside T₂₂.
  std::shared_ptr<const Descriptor> file;  ///< Whose first bytes they are, if memory has a bound; null: none.

  float* brick(std::size_t i) const { return floats.get() + i * stride; }
  std::size_t bytes() const { return count * stride * sizeof(float); }
};

/// Bricks of zeros. They use large pages where the system has them, because rays visit bricks that are far apart in
/// memory. The first writes are expected (`expect_first_writes`). @throw as map_pages.
BrickMemory make_bricks(std::size_t count, int stored_floats, int components);

/// The bricks that another process has made in a file, to be read only. Memory has a bound. @throw std::bad_alloc.
BrickMemory bricks_of_file(Descriptor file, std::size_t count, std::size_t stride, int components);

/// Frees the pages of all bricks but the first ones; pages of a file stay until all are freed.
void keep_bricks(BrickMemory& bricks, std::size_t count);

/// What blocks are placed in.
struct BlockPlaces {
  /// Makes bricks of zeros, for symmetric tensors or for any.
  std::function<BrickMemory(bool symmetric)> make;
  /// Copies a brick of symmetric tensors to one of tensors of any kind.
  void (*widen)(const float* symmetric, float* general);
  /// Places block i. @return false, and leaves the bricks as they are, if they do not have enough components.
  std::function<bool(std::size_t i, const TensorBlock& block, const BrickMemory& bricks)> place;
};

/// Reads each block once, on all threads, and places it. The bricks store symmetric tensors until the first block comes
/// that has others. @throw what `places` and `source` throw.
BrickMemory place_blocks(const BlockSource& source, const BlockPlaces& places);

}  // namespace tensorray
