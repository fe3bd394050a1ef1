#pragma once
/// @file base/files/file_in_pieces.h
/// Large files, written in large pieces.

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/errors.h"

namespace tensorray {

/// A file to which bytes are appended. Memory does not grow with the file.
class FileInPieces {
 public:
  explicit FileInPieces(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary) {}

  /// The bytes to append to. Call `end_of_row` now and then.
  std::string& bytes() { return piece_; }

  /// Writes the bytes if they are enough for a piece.
  void end_of_row() {
    constexpr std::size_t piece_size = 1 << 20;
    if (piece_.size() >= piece_size) flush();
  }

  /// Writes what is left. @throw std::runtime_error naming the file if any byte could not be written.
  void close() {
    flush();
    file_.close();
    if (!file_) fail(path_, "cannot be written; check the path and the space on the disk");
  }

 private:
  void flush() {
    file_.write(piece_.data(), static_cast<std::streamsize>(piece_.size()));
    piece_.clear();
  }

  std::filesystem::path path_;
  std::ofstream file_;
  std::string piece_;
};

}  // namespace tensorray
