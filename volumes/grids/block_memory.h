#pragma once
/// @file volumes/grids/block_memory.h
/// Memory for many large objects of one type, in pages (page_memory.h).

#include <cstddef>
#include <memory>
#include <mutex>

namespace tensorray {

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
