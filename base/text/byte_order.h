#pragma once
/// Reads and appends numbers of files, in either byte order.

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

namespace tensorray {

enum class ByteOrder { little, big };

constexpr ByteOrder host_byte_order() {
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  return ByteOrder::little;
#else
  return ByteOrder::big;
#endif
}

/// Reads the number whose bytes begin at `bytes`. `bytes` need not be aligned.
template <class Number>
Number read_number(const void* bytes, ByteOrder order) {
  std::array<char, sizeof(Number)> copy;
  std::memcpy(copy.data(), bytes, sizeof(Number));
  if (order != host_byte_order()) std::reverse(copy.begin(), copy.end());
  Number number;
  std::memcpy(&number, copy.data(), sizeof(Number));
  return number;
}

/// Appends the bytes of `number`.
template <class Number>
void append_number(Number number, ByteOrder order, std::string& bytes) {
  std::array<char, sizeof(Number)> copy;
  std::memcpy(copy.data(), &number, sizeof(Number));
  if (order != host_byte_order()) std::reverse(copy.begin(), copy.end());
  bytes.append(copy.data(), copy.size());
}

}  // namespace tensorray
