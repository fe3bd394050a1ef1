#include "volumes/files/file_bytes.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/errors.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {

FileBytes::FileBytes(const std::filesystem::path& path) : file_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (file_ < 0) fail(path, "cannot be opened: " + std::generic_category().message(errno) + "; check the path");
  size_ = static_cast<std::int64_t>(std::filesystem::file_size(path));
  if (memory_bound()) return;
  void* const memory = mmap(nullptr, static_cast<std::size_t>(size_), PROT_READ, MAP_SHARED, file_, 0);
  if (memory != MAP_FAILED) mapped_ = static_cast<const char*>(memory);
}

FileBytes::~FileBytes() {
  if (mapped_) munmap(const_cast<char*>(mapped_), static_cast<std::size_t>(size_));
  close(file_);
}

const char* FileBytes::bytes(std::int64_t at, std::size_t count, std::vector<char>& copy) const {
  if (at < 0 || at > size_ || static_cast<std::int64_t>(count) > size_ - at) return nullptr;
  if (mapped_) return mapped_ + at;
  copy.resize(count);
  for (std::size_t done = 0; done < count;) {
    const ssize_t got = pread(file_, copy.data() + done, count - done, static_cast<off_t>(at + std::int64_t(done)));
    if (got <= 0) return nullptr;
    done += static_cast<std::size_t>(got);
  }
  return copy.data();
}

void ByteCursor::skip(std::int64_t bytes) {
  if (bytes < 0 || bytes > file_.size() - at_) throw Misfit();
  at_ += bytes;
}

const char* ByteCursor::next(std::size_t count) {
  const auto wanted = static_cast<std::int64_t>(count);
  if (wanted > file_.size() - at_) throw Misfit();
  if (at_ < first_ || at_ + wanted > end_) {
    const auto rest = static_cast<std::size_t>(file_.size() - at_);
    const std::size_t bytes = file_.is_mapped() ? rest : std::min(std::max(count, window_), rest);
    ahead_ = file_.bytes(at_, bytes, copy_);
    if (!ahead_) throw Misfit();
    first_ = at_;
    end_ = at_ + static_cast<std::int64_t>(bytes);
  }
  at_ += wanted;
  return ahead_ + (at_ - wanted - first_);
}

}  // namespace tensorray
