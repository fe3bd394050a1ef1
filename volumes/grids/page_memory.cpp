#include "volumes/grids/page_memory.h"

#include <cerrno>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

struct MemoryBound {
  std::size_t bytes;
  std::filesystem::path folder;
};

constexpr std::size_t slab_bytes = std::size_t{1} << 23;
constexpr std::size_t before_slot = 16;  // Keeps slots aligned.

/// Null without a bound.
const MemoryBound* the_bound = nullptr;

/// A file of zeros. Its disk has the space: a page that could not be stored would end the process.
Descriptor make_file(std::size_t bytes) {
  Descriptor file = open_unnamed(the_bound->folder);
  const int error = file.is_open() ? posix_fallocate(file.get(), 0, static_cast<off_t>(bytes)) : errno;
  if (error == 0) return file;
  throw std::runtime_error("--memory: " + the_bound->folder.string() + " cannot hold " +
                           bytes_text(static_cast<double>(bytes)) +
                           " of the field: " + std::generic_category().message(error));
}

void* map_bytes(std::size_t bytes, int protection, int flags, int file) {
  void* const memory = mmap(nullptr, bytes, protection, flags, file, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  return memory;
}

}  // namespace

void bound_memory(std::size_t bytes, const std::filesystem::path& folder) {
  if (!the_bound) the_bound = new MemoryBound{bytes, folder};  // Never destroyed.
}

std::optional<std::size_t> memory_bound() { return the_bound ? std::optional(the_bound->bytes) : std::nullopt; }

void* map_pages(std::size_t bytes, Descriptor* file) {
  constexpr int writable = PROT_READ | PROT_WRITE;
  if (the_bound) {
    Descriptor made = make_file(bytes);
    void* const pages = map_bytes(bytes, writable, MAP_SHARED, made.get());
    if (file) *file = std::move(made);
    return pages;
  }
  void* const pages = map_bytes(bytes, writable, MAP_PRIVATE | MAP_ANONYMOUS, -1);
#ifdef MADV_HUGEPAGE
  madvise(pages, bytes, MADV_HUGEPAGE);
#endif
  return pages;
}

void* map_file(const Descriptor& file, std::size_t bytes) {
  return map_bytes(bytes, PROT_READ, MAP_SHARED, file.get());
}

void unmap_pages(void* memory, std::size_t bytes) noexcept { munmap(memory, bytes); }

void release_pages(void* part, std::size_t bytes) noexcept {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const std::uintptr_t first = reinterpret_cast<std::uintptr_t>(part), end = (first + bytes) / page * page;
  const std::uintptr_t begin = (first + page - 1) / page * page;
  // Pages of a file are removed from it, where the file system can do so; if not, they take space until the end.
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, the_bound ? MADV_REMOVE : MADV_DONTNEED);
}

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
