#pragma once
/// Where temporary files are, and folders and files there that vanish by themselves.

#include <filesystem>
#include <functional>
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

// Files without a name that processes of one user on one machine have in common.

/// The file of a key. The process that makes it offers it, and others find it for as long as that one has this object.
/// A file without a name vanishes with the last process that holds it, however that ends. What may be left is a note of
/// a few bytes in the temporary folder, which the next process with this key uses.
///
/// Where processes cannot share (a temporary folder that cannot be written, a system that hides processes from each
/// other), each is alone, and makes its own file. Not for several threads at once.
class SharedFile {
 public:
  /// Finds the file of another process. Waits while another one makes it. If no process has it, others that ask for it
  /// wait until this one offers its own, or until this object ends: one that will not offer must end.
  /// @param key      Letters and digits. @param waiting  Called often while it waits; what it throws ends it.
  SharedFile(const std::string& key, const std::function<void()>& waiting);
  ~SharedFile();
  SharedFile(const SharedFile&) = delete;
  SharedFile& operator=(const SharedFile&) = delete;

  /// The file that another process has made, for reading. Not open: there is none.
  const Descriptor& file() const { return file_; }

  /// Lets other processes have a file that is complete, while this object lives; if that fails, they make their own.
  /// Without effect if another process's file was found.
  void offer(const Descriptor& file);

 private:
  std::filesystem::path path_;  ///< Of the note, which says where the file is.
  Descriptor note_;             ///< Of the process that makes or offers the file; locked until it does.
  Descriptor file_;
};

}  // namespace tensorray
