#include "base/process/archive.h"

#include "base/text/copy_bytes.h"

namespace tensorray {

void Archive::copy(void* values, std::size_t size) {
  if (!reads_) {
    bytes_.append(static_cast<const char*>(values), size);
    return;
  }
  require(size, 1);
  copy_bytes(values, rest_.data(), size);
  rest_.remove_prefix(size);
}

void Archive::require(std::size_t count, std::size_t size) const {
  if (count > rest_.size() / size) throw DamagedArchive();
}

void Archive::finish() const {
  if (!rest_.empty()) throw DamagedArchive();
}

}  // namespace tensorray
