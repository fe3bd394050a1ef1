#pragma once
/// @file tools/import/vtk/vtk_messages.h
/// VTK's readers print what is wrong with a file and go on. Here it is caught, so that it can be thrown.
/// Private to the importer.

#include <filesystem>
#include <string>

namespace tensorray {

/// While alive, VTK's errors and warnings are kept instead of printed. VTK has one output for a process: only one of
/// these may be alive at a time, and no other thread may use VTK meanwhile.
class VtkMessages {
 public:
  VtkMessages();
  ~VtkMessages();
  VtkMessages(const VtkMessages&) = delete;
  VtkMessages& operator=(const VtkMessages&) = delete;

  /// The first warning since construction, one line without VTK's own source position; empty if there was none.
  const std::string& first_warning() const { return warning_; }

  /// The same of errors.
  const std::string& first_error() const { return error_; }

  /// @throw std::runtime_error with the first error and the file's name, if there was one.
  void throw_error(const std::filesystem::path& path) const;

  /// For VTK's callbacks. A warning of an error in reading counts as an error.
  void keep(const char* message, bool is_error);

 private:
  std::string error_, warning_;
  unsigned long error_observer_, warning_observer_;
  int display_mode_, verbosity_;
};

/// While alive, VTK's errors and warnings are dropped. For work on data that have been read, where VTK complains of
/// each cell that is flat; several threads may use VTK meanwhile.
class SilentVtk {
 public:
  SilentVtk();
  ~SilentVtk();
  SilentVtk(const SilentVtk&) = delete;
  SilentVtk& operator=(const SilentVtk&) = delete;

 private:
  int before_;
};

}  // namespace tensorray
