#pragma once
/// Runs the whole program, as a user does.

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/data_folder.h"
#include "tests/files.h"
#include "tests/scenes/small_scene.h"

namespace tensorray {
namespace test {}
using namespace test;
}  // namespace tensorray

namespace tensorray::test {

inline std::string read_file(const std::filesystem::path& path) { return bytes_of(path); }

struct Outcome {
  int status = -1;  ///< Exit status; 128 + the number of the signal if a signal ended the program.
  std::string out, error;
};

using Arguments = std::vector<std::string>;

inline Arguments joined(Arguments first, const Arguments& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

/// Makes a folder for each test, and removes it after the test.
class Program : public ::testing::Test {
 protected:
  Program() { std::filesystem::create_directories(folder_); }

  std::filesystem::path in_folder(const std::string& name) const { return folder_ / name; }

  /// Starts the program with the test's folder as working folder. @return its process.
  pid_t start(const Arguments& arguments) const { return start_in("exec", arguments); }

  /// The same. @param shell  Commands of the shell before the program; the last word runs it: "cd /; exec".
  pid_t start_in(const std::string& shell, const Arguments& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    if (chdir(in_folder("").c_str()) != 0) _exit(126);
    const int out = open("stdout", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int error = open("stderr", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(out, 1);
    dup2(error, 2);
    const std::string command = shell + " \"$0\" \"$@\"";
    std::vector<const char*> argv{"sh", "-c", command.c_str(), TENSORRAY_BINARY};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    argv.push_back(nullptr);
    execv("/bin/sh", const_cast<char**>(argv.data()));
    _exit(127);
  }

  /// Whether a process has not ended yet. It can still be waited for.
  static bool is_running(pid_t child) {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
  }

  Outcome wait_for(pid_t child) const {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(in_folder("stdout")),
            read_file(in_folder("stderr"))};
  }

  Outcome run(const Arguments& arguments) const { return wait_for(start(arguments)); }

  /// A full disk: no file has more than some blocks of 512 bytes.
  Outcome run_with_blocks(int blocks, const Arguments& arguments) const {
    return wait_for(start_in("ulimit -f " + std::to_string(blocks) + "; exec", arguments));
  }

  /// Runs the program, which must succeed.
  Outcome run_well(const Arguments& arguments) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return outcome;
  }

  /// Runs a script of tools/ with the test's folder as working folder. @param variables  "NAME=VALUE ..." for it.
  Outcome run_script(const std::string& script, const std::string& arguments, const std::string& variables = "") const {
    const std::string command = fmt::format("cd '{}' && {} '{}' {} >stdout 2>stderr", in_folder("").string(), variables,
                                            (source_folder() / "tools" / script).string(), arguments);
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(in_folder("stdout")),
            read_file(in_folder("stderr"))};
  }

  /// An error of a user: one line on standard error that has `text`. @param status  0: any but success.
  static void expect_one_line(const Outcome& outcome, const std::string& text, int status = 0) {
    EXPECT_TRUE(status == 0 ? outcome.status != 0 : outcome.status == status) << outcome.status << outcome.error;
    EXPECT_NE(outcome.error.find(text), std::string::npos) << outcome.error << "\nexpected " << text;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }

  /// Runs the program, which must end so.
  void expect_error(const std::string& text, const Arguments& arguments, int status = 0) const {
    expect_one_line(run(arguments), text, status);
  }

  bool has(const std::string& name) const { return std::filesystem::exists(in_folder(name)); }

  bool is_equal(const std::string& a, const std::string& b) const {
    return has(a) && has(b) && read_file(in_folder(a)) == read_file(in_folder(b));
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(in_folder(name), std::ios::binary) << text;
  }

  nlohmann::json read_json(const std::string& name) const { return nlohmann::json::parse(read_file(in_folder(name))); }

  /// Names of the files in the folder, except those that `run` makes.
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(in_folder(""))) {
      const std::string name = entry.path().filename().string();
      if (name != "stdout" && name != "stderr") names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
  }

 private:
  const Temporary folder_{"program"};
};

}  // namespace tensorray::test
