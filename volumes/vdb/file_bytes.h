#pragma once
/// @file volumes/vdb/file_bytes.h
/// The bytes of a file, at any position. Streams read in order, and copy what they skip.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/files/descriptor.h"
#include "base/text/byte_order.h"

namespace tensorray {

/// An open file. Any number of threads may read it at once.
class FileBytes {
 public:
  /// @throw std::runtime_error naming the file and the reason.
  explicit FileBytes(const std::filesystem::path& path);

  std::int64_t size() const { return size_; }

  /// Copies `count` bytes from position `at` on. @return false if the file does not have them, or cannot be read.
  bool read(std::int64_t at, void* bytes, std::size_t count) const;

 private:
  Descriptor file_;
  std::int64_t size_ = 0;
};

/// Thrown where a file has less bytes than are needed, or lengths in it do not fit.
struct FormatError {};

/// Reads a file from front to back. It reads ahead by a window.
class ByteCursor {
 public:
  ByteCursor(const FileBytes& file, std::int64_t at, std::size_t window) : file_(file), at_(at), window_(window) {}

  std::int64_t at() const { return at_; }

  /// @throw FormatError if the file does not have them.
  void skip(std::int64_t bytes);

  /// The next `count` bytes, which stay valid until the next call. @throw FormatError as above.
  const char* next(std::size_t count);

  template <class Number>
  Number number() {
    return read_number<Number>(next(sizeof(Number)), ByteOrder::little);
  }

 private:
  const FileBytes& file_;
  std::int64_t at_, first_ = 0;  ///< The next byte, and that of `bytes_`.
  const std::size_t window_;
  std::vector<char> bytes_;
};

}  // namespace tensorray
