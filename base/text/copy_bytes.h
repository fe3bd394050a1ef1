#pragma once
/// @file base/text/copy_bytes.h
/// std::memcpy of any number of bytes.

#include <cstddef>
#include <cstring>

namespace tensorray {

/// Where there is nothing to copy, pointers may be null, as those of empty vectors are; std::memcpy forbids it.
inline void copy_bytes(void* to, const void* from, std::size_t size) {
  if (size > 0) std::memcpy(to, from, size);
}

}  // namespace tensorray
