#pragma once
/// Output files that are either complete or absent, and never those that a run reads.

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "base/errors.h"

namespace tensorray {

/// A file that is being written. It has a temporary name first, and replaces the target when it is complete. An older
/// file at the target stays until then, and stays if the work fails.
///
/// Symbolic links are followed: the link stays, and the file that it points to is replaced. A target that is not a
/// regular file (a device, a pipe), or that this process has open (/dev/stdout, /dev/fd/3), gets the bytes instead.
class OutputFile {
 public:
  /// Makes the empty temporary file, so that a target that cannot be written is reported before the work begins.
  /// @throw std::runtime_error naming the target and the fix, if the target is a folder, is write-protected, or is open
  /// for reading only, or if its folder is missing or cannot be written.
  explicit OutputFile(std::filesystem::path target);

  /// Removes the temporary file if it was not committed.
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;

  /// The temporary file to write. It has the ending of the target, because writers choose the format by the ending.
  const std::filesystem::path& path() const { return temporary_; }
  const std::filesystem::path& target() const { return target_; }
  bool is_device() const { return is_device_; }

  /// Calls `writer(path())`. In the text of an error that it throws, the target's name replaces the temporary name.
  template <class Writer>
  void write(const Writer& writer) {
    try {
      writer(temporary_);
    } catch (const std::runtime_error& error) {
      rethrow_for_target(error.what());
    }
  }

  /// Makes the file of this text. @throw std::runtime_error naming the target: the disk may be full.
  void write_text(const std::string& text);

  /// Does what commit_all does, for this file alone.
  void commit();

 private:
  friend void commit_all(std::vector<OutputFile>& files);

  [[noreturn]] void rethrow_for_target(std::string message) const;
  void copy_into_device();
  void keep_old();
  void replace_old();
  void undo() noexcept;
  void discard() noexcept;

  std::filesystem::path target_;     ///< The target as the caller gave it.
  std::filesystem::path resolved_;   ///< The target after following symbolic links.
  std::filesystem::path temporary_;  ///< Empty if the file was committed or moved from.
  std::filesystem::path backup_;     ///< The older file of the target, until all files of a commit are in place.
  bool is_device_ = false;
};

/// Replaces each target by the file that was written. A new file takes over the permissions of the old one. Either all
/// targets change or none: the old files are kept until all new files are in place, and are restored if one cannot be
/// placed. There are two exceptions. Bytes that were copied into a device cannot be taken back; devices come first, so
/// that nothing else has changed if one fails. If the process is killed in the short time between two renames, each
/// target is a complete file, but some may be old and some new, and hidden files `.tensorray-*` may be left over.
/// @throw std::runtime_error naming the target and the reason, for example a device that is full.
void commit_all(std::vector<OutputFile>& files);

/// Follows symbolic links. The last one may point to a file that does not exist yet.
/// @throw std::runtime_error if the links form a loop.
std::filesystem::path behind_links(const std::filesystem::path& target);

/// Writes `pieces`, one after the other, to a file beside it, waits until they are on the disk, and gives them the name
/// `file`. Whenever the process or the machine stops, `file` is complete: as it was, or as it becomes. The file beside
/// it, `.tensorray-HASH.new` with a hash of the name, is always the same, so that processes that were killed leave no
/// more than one; it is not one that a user names. An OutputFile, unlike it, follows links.
/// @throw std::runtime_error naming the file, for example because the disk is full. The old file is then unchanged.
void replace_file(const std::filesystem::path& file, const std::vector<std::string_view>& pieces);

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

/// A file that a run reads or writes.
struct NamedFile {
  std::filesystem::path path;  ///< Empty: no file.
  std::string name;            ///< How an error names the file: "`/field/file`", "--stats".
};

/// Whether a path leads to what is neither a file nor a folder: a pipe, a device or a socket. Opening it may never end.
bool is_device(const std::filesystem::path& path);

/// Compares files by device and inode, after following links. A file that does not exist yet is compared by its folder
/// and name. Several outputs may go to the same device or pipe, one after the other.
/// @throw std::invalid_argument that names both files, if an output is the same file as an input or another output; or
/// if an input is a device.
void require_distinct_files(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

}  // namespace tensorray
