#pragma once
/// @file base/files/temporary_folder.h
/// Where temporary files are, and folders and files there that vanish by themselves.

#include <filesystem>
#include <string>

#include "base/files/descriptor.h"

namespace tensorray {

/// The folder for temporary files: $TMPDIR, or /tmp where that is none.
std::filesystem::path temporary_files();

/// A new folder in the temporary folder. The destructor removes it with all its files.
class TemporaryFolder {
 public:
  /// @throw std::runtime_error naming the temporary folder.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Makes an empty file in `folder` that has no name: the system removes it when the last process that holds it ends,
/// for whatever reason. @return a descriptor that is not open if it cannot be made; `errno` says why.
Descriptor open_unnamed(const std::filesystem::path& folder);

/// A file without a name in the temporary folder, to share with a program that this one starts (child_program.h).
class UnnamedFile {
 public:
  /// @throw std::runtime_error naming the temporary folder.
  UnnamedFile();

  /// The path by which only this process can open the file.
  std::filesystem::path path() const;
  int descriptor() const { return file_.get(); }

 private:
  Descriptor file_;
};

}  // namespace tensorray
