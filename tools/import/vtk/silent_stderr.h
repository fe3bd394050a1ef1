#pragma once
/// @file tools/import/vtk/silent_stderr.h
/// netCDF and the C++ runtime write to standard error by themselves. Private to the importer.

namespace tensorray {

/// While alive, what the whole process writes to standard error is dropped. (Of a program built with the address
/// sanitizer it is not: its report would be lost.)
class SilentStderr {
 public:
  SilentStderr();
  ~SilentStderr();
  SilentStderr(const SilentStderr&) = delete;
  SilentStderr& operator=(const SilentStderr&) = delete;

 private:
  int kept_ = -1;
};

}  // namespace tensorray
