#include "tools/import/program/child_process.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <stdexcept>
#include <thread>
#include <utility>

#include <CLI/Error.hpp>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/wait.h>
#include <unistd.h>

#include "tools/command_line/run_and_report.h"

namespace tensorray {
namespace {

/// Makes the child end at once on SIGINT and SIGTERM, because the parent removes the files that it leaves; and makes
/// it end when its parent ends.
void be_mortal() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGTERM);
#endif
}

int wait_for(pid_t child, const Progress& progress) {
  int status = 0;
  bool told = false;
  for (pid_t ended = 0; ended != child; ended = waitpid(child, &status, WNOHANG)) {
    if (ended < 0 && errno != EINTR) throw std::runtime_error("the child process got lost");
    if (progress.cancelled && !std::exchange(told, true)) kill(child, SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return status;
}

}  // namespace

void in_child_process(const std::function<void()>& work, const Progress& progress, const std::string& on_crash) {
  std::fflush(nullptr);  // Otherwise both processes would print what is in the buffers.
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child process can be started: the system has too many");
  if (child == 0) {
    be_mortal();
    _exit(run_and_report(
        work));  // Not exit: the exit handlers of some libraries wait for threads that the child does not have.
  }
  const int status = wait_for(child, progress);
  if (progress.cancelled) throw Cancelled();
  if (WIFSIGNALED(status)) throw std::runtime_error(on_crash);
  if (WEXITSTATUS(status) != 0) throw CLI::RuntimeError(WEXITSTATUS(status));
}

}  // namespace tensorray
