#pragma once
/// @file volumes/grids/block_memory.h
/// Memory for many large things of one type: on large pages, and given back to the system as they go.

#include <cstddef>
#include <memory>
#include <mutex>

namespace tensorray {

/// Slots of one size, in slabs of 2 MB each of which is one large page where the system has them: the system clears
/// such a page ten times as fast as the 512 small ones in its place. A slab goes back when none of its slots is used,
/// but for one, so that a container that grows and shrinks does not ask for it over and over.
class SlotPool {
 public:
  /// @param slot_bytes  A multiple of 16, much less than a slab.
  explicit SlotPool(std::size_t slot_bytes);
  SlotPool(const SlotPool&) = delete;
  SlotPool& operator=(const SlotPool&) = delete;

  /// Has memory for so many slots at hand, which all threads have had the system clear: a container asks slot by slot.
  void prepare(std::size_t slots);

  /// Any thread may call these. @throw std::bad_alloc
  void* take();
  void give_back(void* slot) noexcept;

 private:
  struct Slab;

  void link(Slab* slab) noexcept;
  void unlink(Slab* slab) noexcept;

  std::mutex mutex_;
  const std::size_t slot_bytes_, slots_;  ///< Slots of a slab.
  Slab* open_ = nullptr;                  ///< Slabs with free slots, as a list.
};

/// For containers that allocate their elements one by one, like a deque of large ones; other sizes come from the heap.
template <class T>
struct SlotAllocator {
  using value_type = T;

  SlotAllocator() = default;
  template <class Other>
  SlotAllocator(const SlotAllocator<Other>&) noexcept {}  // NOLINT: containers convert them.

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
    static auto* const shared = new SlotPool((sizeof(T) + 15) / 16 * 16);  // Outlives every container.
    return *shared;
  }
};

}  // namespace tensorray
