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

  /// As commit_all, for this file alone.
  void commit();

 private:
  friend void commit_all(std::vector<OutputFile>& files);

  [[noreturn]] void rethrow_for_target(std::string message) const;
  void copy_into_device();
  void keep_old();
  void replace_old();
  void undo() noexcept;
  void discard() noexcept;

  std::filesystem::path target_;     ///< As given.
  std::filesystem::path resolved_;   ///< Behind symbolic links.
  std::filesystem::path temporary_;  ///< Empty: committed, or moved from.
  std::filesystem::path backup_;     ///< Of what was at the target, until all files of a commit are in place.
  bool is_device_ = false;
};

/// Makes each target what was written; its permissions stay those of the file that was there. All targets change, or
/// none: the old files are kept until all new ones are in place, and come back if one cannot be placed. Two things are
/// beyond that. What has been copied into a device cannot be taken back (devices come first, so that nothing else has
/// changed if one fails). And if the process is killed in the short time between two renames, each target is either
/// the old or the new file, complete, but they may be mixed; hidden files `.tensorray-*` may then be left beside them.
/// @throw std::runtime_error naming the target and the reason (a device that is full, say).
void commit_all(std::vector<OutputFile>& files);

/// Follows symbolic links, also where they end at nothing yet. @throw std::runtime_error if they form a loop.
std::filesystem::path behind_links(const std::filesystem::path& target);

}  // namespace tensorray
