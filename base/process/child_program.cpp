#include "base/process/child_program.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include <spawn.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/wait.h>
#include <unistd.h>

#include "base/process/progress.h"

namespace tensorray {
namespace {

struct SpawnActions {
  SpawnActions() { posix_spawn_file_actions_init(&actions); }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
  posix_spawn_file_actions_t actions;
};

std::filesystem::path& program_folder() {
  static std::filesystem::path folder;  // Empty: that of the running program.
  return folder;
}

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw std::runtime_error("the child process got lost");
  return status;
}

}  // namespace

void use_programs_in(const std::filesystem::path& folder) { program_folder() = folder; }

std::filesystem::path sibling_program(const std::string& name) {
  if (!program_folder().empty()) return program_folder() / name;
  std::error_code none;
  return std::filesystem::read_symlink("/proc/self/exe", none).replace_filename(name);
}

ProgramEnd run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                       const UnnamedFile& shared) {
  const UnnamedFile error;
  SpawnActions spawn;
  posix_spawn_file_actions_adddup2(&spawn.actions, error.descriptor(), 2);
  posix_spawn_file_actions_adddup2(&spawn.actions, shared.descriptor(), 3);
  const std::string name = program.string();
  std::vector<char*> argv{const_cast<char*>(name.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  if (const int failed = posix_spawn(&child, name.c_str(), &spawn.actions, nullptr, argv.data(), environ))
    throw std::runtime_error(name + " cannot be started: " + std::generic_category().message(failed));
  const int status = wait_for(child);
  ProgramEnd end;
  if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  if (WIFEXITED(status)) end.status = WEXITSTATUS(status);
  if (end.signal == SIGINT || end.signal == SIGTERM || end.signal == SIGHUP) throw Cancelled();
  std::ifstream file(error.path(), std::ios::binary);
  end.error.assign(std::istreambuf_iterator<char>(file), {});
  return end;
}

void become_program(const std::filesystem::path& program, char** arguments) {
  std::string name = program.filename().string();
  arguments[0] = name.data();
  execv(program.c_str(), arguments);
  throw std::runtime_error(program.string() + " cannot be started: " + std::generic_category().message(errno));
}

void end_with_parent() {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGTERM);
#endif
}

}  // namespace tensorray
