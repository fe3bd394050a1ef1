#include "base/process/archive.h"

#include <cstring>

namespace tensorray {

void Archive::copy(void* values, std::size_t size) {
  if (!reads_) {
    bytes_.append(static_cast<const char*>(values), size);
    return;
  }
  require(size, 1);
  if (size > 0) std::memcpy(values, rest_.data(), size);  // Pointers of empty vectors may be null.
  rest_.remove_prefix(size);
}

void Archive::require(std::size_t count, std::size_t size) const {
  if (count > rest_.size() / size) throw DamagedArchive();
}

void Archive::finish() const {
  if (!rest_.empty()) throw DamagedArchive();
}

}  // namespace tensorray
