#pragma once
/// @file volumes/grids/page_memory.h
/// Memory of fields, in whole pages. The memory of the process may have a bound. The pages are then those of a file:
/// they leave memory when the bound is near, and return when they are used. Code that uses them does not notice.

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include <tbb/parallel_for.h>

#include "base/files/descriptor.h"

namespace tensorray {

/// Sets the bound: the resident memory of the whole process then stays below `bytes`. Pages of fields are in a file
/// without a name in `folder`. Memory may exceed the bound by what is used within a few milliseconds, up to 64 MB for
/// each thread. Called once, before fields are made; later calls have no effect.
/// @throw std::invalid_argument if the bound is below what a render takes beside its field; std::runtime_error if the
/// folder cannot have such a file.
void bound_memory(std::size_t bytes, const std::filesystem::path& folder);

/// The bound, if there is one.
std::optional<std::size_t> memory_bound();

/// Drops pages if the bound is near. Code that goes through a whole field calls it for each block, because it may fill
/// memory faster than the thread that watches the bound looks. Any thread may call it.
void make_room();

/// The loop over the blocks or bricks of a field: calls `body(i)` for all i below `count`, on all threads, in any
/// order, and makes room before each call. @throw what `body` throws; then not all calls were made.
template <class Body>
void for_blocks(std::size_t count, const Body& body) {
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    make_room();
    body(i);
  });
}

/// Checks that a field can be loaded within the bound, if there is one.
/// @param stored  Bytes of the field's pages. @param resident  Bytes that it needs beside them.
/// @throw std::runtime_error with the numbers, if the disk has less space, or the bound is too small.
void require_room(double stored, double resident);

/// Maps pages of zeros. @param alignment  Of the address: a power of two. Any thread may call this and `unmap_pages`.
/// @throw std::bad_alloc; std::runtime_error with the numbers if there is a bound and the disk is full.
void* map_pages(std::size_t bytes, std::size_t alignment);

void unmap_pages(void* memory, std::size_t bytes) noexcept;

/// With a bound: a file of zeros, without a name, whose pages other processes can map as well. @throw as map_pages.
Descriptor make_page_file(std::size_t bytes);

/// With a bound: maps the first bytes of such a file; `unmap_pages` unmaps them. @param writable  Else they are only
/// read. @throw std::bad_alloc.
void* map_page_file(const Descriptor& file, std::size_t bytes, bool writable);

/// Tells whether the next writes to pages of `map_pages` are mostly the first ones. While they are, a page comes alone:
/// file systems that keep pages in large groups take time for the whole group whenever one of its pages is first
/// written. Otherwise a page brings its neighbours from the disk. Without a bound this has no effect.
void expect_first_writes(void* memory, std::size_t bytes, bool expected) noexcept;

/// Frees the whole pages within a part of what `map_pages` gave, which is not used any more. Those of a file are kept.
void release_pages(void* part, std::size_t bytes) noexcept;

/// An allocator of large arrays. They are pages if there is a bound, which must be set before an array is made.
template <class T>
struct PageAllocator {
  using value_type = T;

  PageAllocator() = default;
  template <class Other>
  PageAllocator(const PageAllocator<Other>&) noexcept {}  // NOLINT: containers convert allocators implicitly.

  T* allocate(std::size_t count) {
    if (!memory_bound()) return std::allocator<T>().allocate(count);
    return static_cast<T*>(map_pages(count * sizeof(T), 4096));
  }
  void deallocate(T* memory, std::size_t count) noexcept {
    if (!memory_bound()) return std::allocator<T>().deallocate(memory, count);
    unmap_pages(memory, count * sizeof(T));
  }

  friend bool operator==(const PageAllocator&, const PageAllocator&) { return true; }
  friend bool operator!=(const PageAllocator&, const PageAllocator&) { return false; }
};

}  // namespace tensorray
