#pragma once
/// @file base/files/shared_file.h
/// Files without a name that processes of one user on one machine have in common.

#include <filesystem>
#include <functional>
#include <string>

#include "base/files/descriptor.h"

namespace tensorray {

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
  /// @param key      Letters and digits. @param waiting  Called every few hundredths of a second of waiting; what it
  /// throws ends it.
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
