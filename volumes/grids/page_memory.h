#pragma once
/// Memory of fields, and of the voxels that they are made of, in whole pages. With `--memory` the pages are those of
/// files: the system's page cache holds as many of them as there is room for, takes them away when memory is needed,
/// and brings them back when they are used. Code that uses them does not notice.

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "base/files/descriptor.h"

namespace tensorray {

/// From now on pages are those of files in `folder`. The files have no names: they vanish with the process, however it
/// ends. @param bytes  What the making of a field may use of its pages at a time. Called before fields are made; later
/// calls have no effect.
void bound_memory(std::size_t bytes, const std::filesystem::path& folder);

/// What `bound_memory` was given, if it was called.
std::optional<std::size_t> memory_bound();

/// Maps pages of zeros: large ones, where memory has no bound and the system has such pages. Any thread may call this.
/// @param file  Gets the file of the pages, if memory has a bound; null: nobody asks for it.
/// @throw std::bad_alloc; std::runtime_error, one line that names the folder, if its disk has no space for them.
void* map_pages(std::size_t bytes, Descriptor* file = nullptr);

/// Maps the first bytes of a file, to be read only. @throw std::bad_alloc.
void* map_file(const Descriptor& file, std::size_t bytes);

/// Frees what was mapped, with the space on the disk.
void unmap_pages(void* memory, std::size_t bytes) noexcept;

/// Frees the whole pages within a part of what `map_pages` gave, which is not used any more.
void release_pages(void* part, std::size_t bytes) noexcept;

/// An allocator of arrays: large ones are pages.
template <class T>
struct PageAllocator {
  using value_type = T;

  PageAllocator() = default;
  template <class Other>
  PageAllocator(const PageAllocator<Other>&) noexcept {}  // NOLINT: containers convert allocators implicitly.

  T* allocate(std::size_t count) {
    if (!is_large(count)) return std::allocator<T>().allocate(count);
    return static_cast<T*>(map_pages(count * sizeof(T)));
  }
  void deallocate(T* memory, std::size_t count) noexcept {
    if (!is_large(count)) return std::allocator<T>().deallocate(memory, count);
    unmap_pages(memory, count * sizeof(T));
  }

  friend bool operator==(const PageAllocator&, const PageAllocator&) { return true; }
  friend bool operator!=(const PageAllocator&, const PageAllocator&) { return false; }

 private:
  static bool is_large(std::size_t count) { return count >= (std::size_t{1} << 20) / sizeof(T); }
};

/// Slots of one size, in slabs of pages. A slab is freed with the last of its slots.
class SlotPool {
 public:
  explicit SlotPool(std::size_t slot_bytes);
  SlotPool(const SlotPool&) = delete;
  SlotPool& operator=(const SlotPool&) = delete;

  /// Any thread may take a slot, and give it back. @throw as map_pages.
  void* take();
  void give_back(void* slot) noexcept;

 private:
  struct Slab;

  std::mutex mutex_;
  const std::size_t stride_;  ///< From slot to slot, bytes. Before each slot is the address of its slab.
  Slab* open_ = nullptr;      ///< Where the next slot is taken.
};

/// An allocator for containers that allocate one element at a time, such as a deque of large elements. Single elements
/// of at least 4096 bytes come from a SlotPool; everything else comes from the heap.
template <class T>
struct SlotAllocator {
  using value_type = T;

  SlotAllocator() = default;
  template <class Other>
  SlotAllocator(const SlotAllocator<Other>&) noexcept {}  // NOLINT: containers convert allocators implicitly.

  T* allocate(std::size_t count) {
    if (!is_slot(count)) return std::allocator<T>().allocate(count);
    return static_cast<T*>(pool().take());
  }
  void deallocate(T* memory, std::size_t count) noexcept {
    if (!is_slot(count)) return std::allocator<T>().deallocate(memory, count);
    pool().give_back(memory);
  }

  friend bool operator==(const SlotAllocator&, const SlotAllocator&) { return true; }
  friend bool operator!=(const SlotAllocator&, const SlotAllocator&) { return false; }

 private:
  static bool is_slot(std::size_t count) { return sizeof(T) >= 4096 && count == 1; }
  static SlotPool& pool() {
    static auto* const shared = new SlotPool(sizeof(T));  // Never destroyed: outlives all containers.
    return *shared;
  }
};

}  // namespace tensorray
