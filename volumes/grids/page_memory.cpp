#include "volumes/grids/page_memory.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/files/descriptor.h"
#include "base/files/temporary_folder.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr std::size_t dropped_at_once = std::size_t{1} << 22;
constexpr std::chrono::milliseconds pause(1);
constexpr std::size_t least_bound = std::size_t{1} << 28;
constexpr double high = 0.75, low = 0.55;  ///< Parts of the bound: pages are dropped at `high`, until it is `low`.

/// What is resident of this process.
std::size_t resident() {
  // It stays open: the thread that watches may read it until the process ends.
  static const Descriptor& file = *new Descriptor(open_file("/proc/self/statm", O_RDONLY));
  std::array<char, 128> text{};
  if (pread(file.get(), text.data(), text.size() - 1, 0) <= 0) return 0;
  char* second = nullptr;
  std::strtoull(text.data(), &second, 10);
  return std::strtoull(second, nullptr, 10) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

Descriptor open_nameless(const std::filesystem::path& folder) {
  Descriptor file = open_unnamed(folder);
  if (!file.is_open())
    throw std::runtime_error("--memory: no file for the field can be made in " + folder.string() + ": " +
                             std::generic_category().message(errno));
  return file;
}

/// The file, and where its pages and those of other files are in memory.
class PageStore {
 public:
  PageStore(std::size_t bound, std::filesystem::path folder)
      : bound_(bound), folder_(std::move(folder)), file_(open_nameless(folder_)), watcher_([this] { watch(); }) {}

  std::size_t bound() const { return bound_; }

  double free_bytes() const {
    struct statvfs status {};
    return fstatvfs(file_.get(), &status) == 0
               ? static_cast<double>(status.f_bavail) * static_cast<double>(status.f_frsize)
               : 0;
  }

  const std::filesystem::path& folder() const { return folder_; }

  void make_room() {
    if (!is_near()) return;
    const std::lock_guard lock(mutex_);
    if (is_near()) drop_pages();
  }

  /// Replaces memory by pages of the file.
  void place(char* memory, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    take_space(file_, end_, bytes);
    if (mmap(memory, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, file_.get(), end_) == MAP_FAILED)
      throw std::bad_alloc();
    regions_[memory] = {bytes, end_};
    end_ += static_cast<off_t>(bytes);
  }

  Descriptor make_file(std::size_t bytes) {
    Descriptor file = open_nameless(folder_);
    const std::lock_guard lock(mutex_);
    take_space(file, 0, bytes);
    return file;
  }

  void* map_file(const Descriptor& file, std::size_t bytes, int protection) {
    void* const memory = mmap(nullptr, bytes, protection, MAP_SHARED, file.get(), 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    const std::lock_guard lock(mutex_);
    regions_[static_cast<char*>(memory)] = {bytes, in_own_file};
    return memory;
  }

  /// Gives the space of these pages back to the disk. Where the file system cannot, they take it until the end.
  void remove(char* memory) noexcept {
    const std::lock_guard lock(mutex_);
    const auto region = regions_.find(memory);
    if (region == regions_.end()) return;
    constexpr int hole = FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE;
    const auto size = static_cast<off_t>(region->second.bytes);
    if (region->second.offset != in_own_file)
      static_cast<void>(fallocate(file_.get(), hole, region->second.offset, size));
    regions_.erase(region);
  }

 private:
  struct Region {
    std::size_t bytes;
    off_t offset;
  };
  static constexpr off_t in_own_file = -1;

  bool is_near() const { return static_cast<double>(resident()) > high * static_cast<double>(bound_); }

  /// Makes room in memory, and takes space on the disk.
  void take_space(const Descriptor& file, off_t offset, std::size_t bytes) {
    if (is_near()) drop_pages();
    if (resident() > bound_)
      throw std::runtime_error("--memory " + bytes_text(static_cast<double>(bound_)) +
                               ": what is beside the field takes " + bytes_text(static_cast<double>(resident())) +
                               "; give more");
    // The disk must have the space now: a page that cannot be stored would end the process.
    if (posix_fallocate(file.get(), offset, static_cast<off_t>(bytes)) != 0)
      throw std::runtime_error("--memory: the disk of " + folder_.string() + " has no space for " +
                               bytes_text(static_cast<double>(bytes)) + " more of the field");
  }

  void watch() {
    for (;;) {
      std::this_thread::sleep_for(pause);
      make_room();
    }
  }

  /// Drops pages in turn, as a clock does: those that are used come back soon. The file keeps their bytes.
  void drop_pages() {
    std::size_t dropped = 0, all = 0;
    for (const auto& [memory, region] : regions_) all += region.bytes;
    const double wanted = low * static_cast<double>(bound_);
    while (dropped < all && wanted < static_cast<double>(resident())) {
      auto region = regions_.upper_bound(hand_);
      if (region != regions_.begin()) --region;  // The one that the hand points into, or the next.
      if (region->first + region->second.bytes <= hand_ && ++region == regions_.end()) region = regions_.begin();
      char* const begin = hand_ > region->first && hand_ < region->first + region->second.bytes ? hand_ : region->first;
      const std::size_t left = static_cast<std::size_t>(region->first + region->second.bytes - begin);
      const std::size_t bytes = std::min(dropped_at_once, left);
      madvise(begin, bytes, MADV_DONTNEED);
      dropped += bytes;
      hand_ = begin + bytes;
    }
  }

  const std::size_t bound_;
  const std::filesystem::path folder_;
  const Descriptor file_;
  std::mutex mutex_;
  std::map<char*, Region> regions_;
  off_t end_ = 0;
  char* hand_ = nullptr;
  std::thread watcher_;
};

/// Null without a bound. Never destroyed: memory may be freed after everything else.
PageStore* store = nullptr;

}  // namespace

void bound_memory(std::size_t bytes, const std::filesystem::path& folder) {
  if (store) return;
  if (bytes < least_bound)
    throw std::invalid_argument("--memory " + bytes_text(static_cast<double>(bytes)) +
                                ": the program takes as much beside its field; give " +
                                bytes_text(static_cast<double>(least_bound)) + " at least");
  store = new PageStore(bytes, folder);
}

std::optional<std::size_t> memory_bound() { return store ? std::optional(store->bound()) : std::nullopt; }

void make_room() {
  if (store) store->make_room();
}

void require_room(double stored, double needed) {
  if (!store) return;
  if (stored > store->free_bytes())
    throw std::runtime_error("--memory: the field needs " + bytes_text(stored) + " on the disk of " +
                             store->folder().string() + ", where " + bytes_text(store->free_bytes()) + " are free");
  const double all = static_cast<double>(resident()) + needed;
  if (all > high * static_cast<double>(store->bound()))
    throw std::runtime_error("--memory " + bytes_text(static_cast<double>(store->bound())) +
                             ": the program and the tables of the field take " + bytes_text(all) + "; give " +
                             bytes_text(all / high) + " at least");
}

void* map_pages(std::size_t bytes, std::size_t alignment) {
  const std::size_t reserved = bytes + alignment;
  void* const memory = mmap(nullptr, reserved, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  char* const begin = static_cast<char*>(memory);
  const std::size_t before = -reinterpret_cast<std::uintptr_t>(memory) % alignment;
  const std::size_t page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t kept = (bytes + page - 1) / page * page;
  if (before > 0) munmap(begin, before);
  if (before + kept < reserved) munmap(begin + before + kept, reserved - before - kept);
  char* const pages = begin + before;
  if (store) {
    try {
      store->place(pages, kept);
    } catch (...) {
      munmap(pages, kept);
      throw;
    }
    return pages;
  }
#ifdef MADV_HUGEPAGE
  madvise(pages, bytes, MADV_HUGEPAGE);
#endif
  return pages;
}

void unmap_pages(void* memory, std::size_t bytes) noexcept {
  if (store) store->remove(static_cast<char*>(memory));
  munmap(memory, bytes);
}

Descriptor make_page_file(std::size_t bytes) { return store->make_file(bytes); }

void* map_page_file(const Descriptor& file, std::size_t bytes, bool writable) {
  return store->map_file(file, bytes, writable ? PROT_READ | PROT_WRITE : PROT_READ);
}

void expect_first_writes(void* memory, std::size_t bytes, bool expected) noexcept {
  if (store) madvise(memory, bytes, expected ? MADV_RANDOM : MADV_NORMAL);
}

void release_pages(void* part, std::size_t bytes) noexcept {
  if (store) return;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const std::uintptr_t first = reinterpret_cast<std::uintptr_t>(part), end = (first + bytes) / page * page;
  const std::uintptr_t begin = (first + page - 1) / page * page;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
}

}  // namespace tensorray
