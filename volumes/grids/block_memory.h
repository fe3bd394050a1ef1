#pragma once
/// @file volumes/grids/block_memory.h
/// Memory for many large objects of one type. It uses large pages, and returns them to the system when objects are
/// freed.

#include <cstddef>
#include <memory>
#include <mutex>

namespace tensorray {

/// A pool of slots of one size, in slabs of 2 MB. A slab is one large page where the system has such pages: the system
/// clears one ten times as fast as the 512 small pages that it replaces. A slab without used slots is returned to the
/// system unless no other slab has a free slot, so that a container that grows and shrinks does not map the same slab
/// again and again.
class SlotPool {
 public:
  /// @param slot_bytes  A multiple of 16, much less than a slab.
  explicit SlotPool(std::size_t slot_bytes);
  SlotPool(const SlotPool&) = delete;
  SlotPool& operator=(const SlotPool&) = delete;

  /// Maps memory for `slots` slots in advance. All threads take part, so that the system clears pages in parallel;
  /// without this a container maps memory slot by slot.
  void prepare(std::size_t slots);

  /// Any thread may call these functions. @throw std::bad_alloc
  void* take();
  void give_back(void* slot) noexcept;

 private:
  struct Slab;

  void link(Slab* slab) noexcept;
  void unlink(Slab* slab) noexcept;

  std::mutex mutex_;
  const std::size_t slot_bytes_, slots_;  ///< Size of a slot, bytes; slots per slab.
  Slab* open_ = nullptr;                  ///< List of the slabs with free slots.
};

/// An allocator for containers that allocate one element at a time, such as a deque of large elements. Single elements
/// of at least 4096 bytes come from a SlotPool; everything else comes from the heap.
template <class T>
struct SlotAllocator {
  using value_type = T;

  SlotAllocator() = default;
  template <class Other>
  SlotAllocator(const SlotAllocator<Other>&) noexcept {}  // NOLINT: containers convert allocators implicitly.

  static void prepare(std::size_t count) { pool().prepare(count); }

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
    static auto* const shared = new SlotPool((sizeof(T) + 15) / 16 * 16);  // Never destroyed: outlives all containers.
    return *shared;
  }
};

}  // namespace tensorray
