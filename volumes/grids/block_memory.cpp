#include "volumes/grids/block_memory.h"

#include <cstdint>
#include <new>

#include <tbb/parallel_for.h>

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

constexpr std::size_t slab_bytes = std::size_t{1} << 21;
constexpr std::size_t header_bytes = 64;

struct FreeSlot {
  FreeSlot* next;
};

/// Maps a slab. Its address is a multiple of its size, so that the address of a slot gives its slab, and so that the
/// system can use one large page.
void* map_slab() { return map_pages(slab_bytes, slab_bytes); }

}  // namespace

/// The header of a slab. It is at the beginning of the slab's memory, and the slots follow it.
struct SlotPool::Slab {
  Slab *before = nullptr, *after = nullptr;  // Neighbours in the list of slabs with free slots.
  std::size_t fresh = 0, used = 0;           // Slots that were ever taken; slots that are taken now.
  FreeSlot* free = nullptr;                  // List of the slots that were given back.
};

SlotPool::SlotPool(std::size_t slot_bytes) : slot_bytes_(slot_bytes), slots_((slab_bytes - header_bytes) / slot_bytes) {
  static_assert(sizeof(Slab) <= header_bytes);
}

void SlotPool::link(Slab* slab) noexcept {
  slab->before = nullptr;
  slab->after = open_;
  if (open_) open_->before = slab;
  open_ = slab;
}

void SlotPool::unlink(Slab* slab) noexcept {
  (slab->before ? slab->before->after : open_) = slab->after;
  if (slab->after) slab->after->before = slab->before;
}

void SlotPool::prepare(std::size_t slots) {
  tbb::parallel_for(std::size_t{0}, (slots + slots_ - 1) / slots_, [&](std::size_t) {
    auto* const slab = new (map_slab()) Slab;  // The first write makes the system clear the page.
    const std::lock_guard<std::mutex> lock(mutex_);
    link(slab);
  });
}

void* SlotPool::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!open_) link(new (map_slab()) Slab);
  Slab* const slab = open_;
  if (++slab->used == slots_) unlink(slab);
  if (FreeSlot* const slot = slab->free) {
    slab->free = slot->next;
    return slot;
  }
  return reinterpret_cast<char*>(slab) + header_bytes + slot_bytes_ * slab->fresh++;
}

void SlotPool::give_back(void* slot) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto* const slab = reinterpret_cast<Slab*>(reinterpret_cast<std::uintptr_t>(slot) / slab_bytes * slab_bytes);
  if (slab->used-- == slots_) link(slab);
  slab->free = new (slot) FreeSlot{slab->free};
  const bool only_one = !slab->before && !slab->after;
  if (slab->used > 0 || only_one) return;
  unlink(slab);
  unmap_pages(slab, slab_bytes);
}

}  // namespace tensorray
