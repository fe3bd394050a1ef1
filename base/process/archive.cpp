#include "base/process/archive.h"

#include <limits>
#include <new>

#include <zlib.h>

namespace tensorray {
namespace {

constexpr int quickly = 1;  // zlib's level; higher ones find a few percent more in numbers.

/// The first bytes of all structs, then the second ones: these resemble each other most. @param back  The reverse.
void transpose(const char* from, std::size_t count, std::size_t size, bool back, char* to) {
  for (std::size_t byte = 0; byte < size; ++byte)
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t whole = i * size + byte, plane = byte * count + i;
      to[back ? whole : plane] = from[back ? plane : whole];
    }
}

}  // namespace

void Archive::copy_packed(void* values, std::size_t count, std::size_t size) {
  if (count * size > std::numeric_limits<uInt>::max()) throw std::length_error("too much to be compressed at once");
  std::string planes(count * size, 0), packed;
  if (!reads_) {
    transpose(static_cast<const char*>(values), count, size, false, planes.data());
    uLongf length = compressBound(planes.size());
    packed.resize(length);
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(planes.data()),
                  planes.size(), quickly) != Z_OK)
      throw std::bad_alloc();
    packed.resize(length);
    return copy_list(packed);
  }
  copy_list(packed);
  uLongf length = planes.size();
  const int status = uncompress(reinterpret_cast<Bytef*>(planes.data()), &length,
                                reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || length != planes.size()) throw DamagedArchive();
  transpose(planes.data(), count, size, true, static_cast<char*>(values));
}

}  // namespace tensorray
