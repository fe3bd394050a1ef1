#pragma once
/// Memory for the bricks of a field, and for the blocks that they are made of.

#include <memory>

#include "base/files/descriptor.h"

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
/// memory. @throw as map_pages.
BrickMemory make_bricks(std::size_t count, int stored_floats, int components);

/// The bricks at the beginning of a file, to be read only. @throw std::bad_alloc.
BrickMemory bricks_of_file(Descriptor file, std::size_t count, std::size_t stride, int components);

/// Frees the pages of all bricks but the first ones.
void keep_bricks(BrickMemory& bricks, std::size_t count);

}  // namespace tensorray
