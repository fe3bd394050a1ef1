#include "volumes/grids/block_memory.h"

#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

constexpr std::size_t slab_bytes = std::size_t{1} << 23;
constexpr std::size_t before_slot = 16;  // Keeps slots aligned.

}  // namespace

struct SlotPool::Slab {
  char* pages;
  std::size_t taken = 0, used = 0;  ///< Slots that were ever taken; that are not given back.
};

SlotPool::SlotPool(std::size_t slot_bytes) : stride_((slot_bytes + 15) / 16 * 16 + before_slot) {}

void* SlotPool::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!open_ || (open_->taken + 1) * stride_ > slab_bytes) open_ = new Slab{static_cast<char*>(map_pages(slab_bytes))};
  char* const place = open_->pages + stride_ * open_->taken;
  *reinterpret_cast<Slab**>(place) = open_;
  ++open_->taken;
  ++open_->used;
  return place + before_slot;
}

void SlotPool::give_back(void* slot) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  Slab* const slab = *reinterpret_cast<Slab**>(static_cast<char*>(slot) - before_slot);
  if (--slab->used > 0) return;
  if (slab == open_) {
    slab->taken = 0;
    return;
  }
  unmap_pages(slab->pages, slab_bytes);
  delete slab;
}

}  // namespace tensorray
