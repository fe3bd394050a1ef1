#include "volumes/vdb/file_bytes.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fcntl.h>

#include "base/errors.h"

namespace tensorray {

FileBytes::FileBytes(const std::filesystem::path& path) : file_(open_file(path, O_RDONLY)) {
  if (!file_.is_open()) fail(path, "cannot be opened: " + std::generic_category().message(errno) + "; check the path");
  size_ = static_cast<std::int64_t>(std::filesystem::file_size(path));
}

bool FileBytes::read(std::int64_t at, void* bytes, std::size_t count) const {
  return read_whole_at(file_.get(), bytes, count, static_cast<std::uint64_t>(at));
}

void ByteCursor::skip(std::int64_t bytes) {
  if (bytes < 0 || bytes > file_.size() - at_) throw FormatError();
  at_ += bytes;
}

const char* ByteCursor::next(std::size_t count) {
  const auto wanted = static_cast<std::int64_t>(count);
  if (wanted > file_.size() - at_) throw FormatError();
  if (at_ < first_ || at_ + wanted > first_ + static_cast<std::int64_t>(bytes_.size())) {
    first_ = at_;
    bytes_.resize(std::min(std::max(count, window_), static_cast<std::size_t>(file_.size() - at_)));
    if (!file_.read(first_, bytes_.data(), bytes_.size())) throw FormatError();
  }
  at_ += wanted;
  return bytes_.data() + (at_ - wanted - first_);
}

}  // namespace tensorray
