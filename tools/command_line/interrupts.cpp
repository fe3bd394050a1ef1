#include "tools/command_line/interrupts.h"

#include <atomic>
#include <csignal>

namespace tensorray {
namespace {

// Global, because a signal handler can reach nothing else.
Progress progress;
std::atomic<bool> picture_request{false};

void on_interrupt(int) {
  progress.cancelled = true;
  std::signal(SIGINT, SIG_DFL);
}

void on_picture_request(int) { picture_request = true; }

}  // namespace

Progress& progress_until_interrupted() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  struct sigaction hangup {};  // nohup has it ignored.
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) std::signal(SIGHUP, on_interrupt);
  std::signal(SIGUSR1, on_picture_request);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  return progress;
}

bool take_picture_request() { return picture_request.exchange(false); }

}  // namespace tensorray
