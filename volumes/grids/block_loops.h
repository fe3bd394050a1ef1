#pragma once
/// @file volumes/grids/block_loops.h
/// The loop over the blocks or bricks of a field, which may be larger than the memory.

#include <cstddef>

#include <tbb/parallel_for.h>

#include "volumes/grids/page_memory.h"

namespace tensorray {

/// Calls `body(i)` for all i below `count`, on all threads, in any order. Before each call there is room for a block.
/// @throw what `body` throws; then not all calls were made.
template <class Body>
void for_blocks(std::size_t count, const Body& body) {
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    make_room();
    body(i);
  });
}

}  // namespace tensorray
