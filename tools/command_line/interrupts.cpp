#include "tools/command_line/interrupts.h"

#include <csignal>

namespace tensorray {
namespace {

Progress progress;  // Global, because a signal handler can reach nothing else.

void on_interrupt(int) {
  progress.cancelled = true;
  std::signal(SIGINT, SIG_DFL);
}

}  // namespace

Progress& progress_until_interrupted() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  return progress;
}

}  // namespace tensorray
