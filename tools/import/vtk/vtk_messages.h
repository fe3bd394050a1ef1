#pragma once
/// Catches the messages of VTK's readers, so that they can be thrown: the readers print errors in a file and
/// continue.

#include <filesystem>
#include <string>

#include "base/files/descriptor.h"

namespace tensorray {

/// Until it is destroyed, keeps VTK's errors and warnings instead of printing them, and drops what is written to
/// standard error: netCDF and the C++ runtime write there directly. (Not in a program built with a sanitizer, whose
/// report would be lost.) VTK has one output per process: only one VtkMessages may exist at a time, and no other thread
/// may use VTK meanwhile.
class VtkMessages {
 public:
  VtkMessages();
  ~VtkMessages();
  VtkMessages(const VtkMessages&) = delete;
  VtkMessages& operator=(const VtkMessages&) = delete;

  /// The first warning since construction, in one line without VTK's source position; empty if there was none.
  const std::string& first_warning() const { return warning_; }

  /// The first error since construction, in the same form.
  const std::string& first_error() const { return error_; }

  /// @throw std::runtime_error with the first error and the file's name, if there was one.
  void throw_error(const std::filesystem::path& path) const;

  /// Forgets errors and warnings so far.
  void forget() { error_.clear(), warning_.clear(); }

  /// Called by VTK's callbacks. A warning about an error in reading counts as an error.
  void keep(const char* message, bool is_error);

 private:
  std::string error_, warning_;
  unsigned long error_observer_, warning_observer_;
  int display_mode_, verbosity_;
  Descriptor stderr_;  ///< What standard error was.
};

}  // namespace tensorray
