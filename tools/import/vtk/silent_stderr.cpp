#include "tools/import/vtk/silent_stderr.h"

#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

namespace tensorray {

SilentStderr::SilentStderr() {
#ifndef TENSORRAY_SANITIZED
  std::fflush(stderr);
  const Descriptor nowhere = open_file("/dev/null", O_WRONLY);
  if (!nowhere.is_open()) return;
  kept_ = Descriptor(fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3));
  if (kept_.is_open()) dup2(nowhere.get(), STDERR_FILENO);
#endif
}

SilentStderr::~SilentStderr() {
  if (!kept_.is_open()) return;
  std::fflush(stderr);
  dup2(kept_.get(), STDERR_FILENO);
}

}  // namespace tensorray
