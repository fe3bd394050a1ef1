#include "tools/import/program/child_process.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <stdexcept>
#include <thread>
#include <utility>

#include <CLI/Error.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "base/process/child_program.h"
#include "base/process/process_limits.h"
#include "tools/command_line/run_and_report.h"

namespace tensorray {
namespace {

sigset_t interrupts() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals, signal);
  return signals;
}

/// Makes the child end at once on SIGINT and SIGTERM, because the parent removes the files that it leaves; makes it end
/// when its parent ends, and fail where it would take all memory. @param mask  The signals that the parent had blocked
/// before it forked.
void be_mortal(const sigset_t& mask) {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
  pthread_sigmask(SIG_SETMASK, &mask, nullptr);
  end_with_parent();
  limit_memory();
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
  // A signal that comes before the child has its own handlers waits for them.
  const sigset_t blocked = interrupts();
  sigset_t mask;
  pthread_sigmask(SIG_BLOCK, &blocked, &mask);
  const pid_t child = fork();
  if (child != 0) pthread_sigmask(SIG_SETMASK, &mask, nullptr);
  if (child < 0) throw std::runtime_error("no child process can be started: the system has too many");
  if (child == 0) {
    be_mortal(mask);
    _exit(run_and_report(work));  // Not exit: some libraries wait there for threads that the child does not have.
  }
  const int status = wait_for(child, progress);
  if (progress.cancelled) throw Cancelled();
  if (WIFSIGNALED(status)) throw std::runtime_error(on_crash);
  if (WEXITSTATUS(status) != 0) throw CLI::RuntimeError(WEXITSTATUS(status));
}

}  // namespace tensorray
