#pragma once
/// @file tools/import/vtk/silent_stderr.h
/// Silences standard error, because netCDF and the C++ runtime write to it directly. Private to the importer.

#include "base/files/descriptor.h"

namespace tensorray {

/// Until it is destroyed, drops everything that the process writes to standard error. (It does nothing in a program
/// built with the address sanitizer, whose report would be lost.)
class SilentStderr {
 public:
  SilentStderr();
  ~SilentStderr();
  SilentStderr(const SilentStderr&) = delete;
  SilentStderr& operator=(const SilentStderr&) = delete;

 private:
  Descriptor kept_;
};

}  // namespace tensorray
