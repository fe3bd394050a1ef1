#pragma once
/// @file base/output_file.h
/// Files that are complete or absent.

#include <filesystem>
#include <vector>

namespace tensorray {

/// A file being written: under a temporary name first, which takes the target's place when complete. What was at the
/// target before stays until then, and stays if the work fails.
///
/// Symbolic links are followed: the link stays, and what it points to is replaced. A target that is no regular file (a
/// device, a pipe) is never replaced: the bytes are copied into it.
class OutputFile {
 public:
  /// Makes the temporary file, empty, so that a target that cannot be written is known before the work is done.
  /// @throw std::runtime_error naming the target and the mend: a folder, in a folder that is missing or cannot be
  /// written, write-protected.
  explicit OutputFile(std::filesystem::path target);

  /// Removes the temporary file if it was not committed.
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;

  /// The temporary file to write. It has the target's ending, by which formats are chosen.
  const std::filesystem::path& path() const { return temporary_; }
  const std::filesystem::path& target() const { return target_; }
  bool is_device() const { return is_device_; }

  /// Lets `writer(path())` write the temporary file; what it throws then names the target instead.
  template <class Writer>
  void write(const Writer& writer) {
    try {
      writer(temporary_);
    } catch (const std::runtime_error& error) {
      rethrow_for_target(error.what());
    }
  }

  /// Makes the target what was written; its permissions stay those of the file that was there.
  /// @throw std::runtime_error naming the target and the reason (a device that is full, say).
  void commit();

 private:
  [[noreturn]] void rethrow_for_target(std::string message) const;
  void discard() noexcept;

  std::filesystem::path target_;     ///< As given.
  std::filesystem::path resolved_;   ///< Behind symbolic links.
  std::filesystem::path temporary_;  ///< Empty: committed, or moved from.
  bool is_device_ = false;
};

/// Commits all, those first that are the most likely to fail (devices). @throw std::runtime_error as commit.
void commit_all(std::vector<OutputFile>& files);

}  // namespace tensorray
