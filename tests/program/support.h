#pragma once
/// Runs the whole program, as a user does.

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "renderer/images/image.h"
#include "tests/data_folder.h"
#include "tests/files.h"
#include "tests/scenes/small_scene.h"

namespace tensorray {
namespace test {}
using namespace test;
}  // namespace tensorray

namespace tensorray::test {

using nlohmann::json;

struct Outcome {
  int status = -1;  ///< Exit status; 128 + the number of the signal if a signal ended the program.
  std::string out, error;
};

using Arguments = std::vector<std::string>;

inline Arguments joined(Arguments first, const Arguments& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

inline std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

/// The options that change a scene: "--set KEY=VALUE" of each.
inline Arguments changes(const Arguments& keys_and_values) {
  Arguments arguments;
  for (const std::string& change : keys_and_values) arguments.insert(arguments.end(), {"--set", change});
  return arguments;
}

/// A NRRD of symmetric tensors. @param size  Numbers of voxels: "2 3 4".
inline std::string nrrd(const std::string& size, const std::string& numbers) {
  return "NRRD0005\ntype: float\ndimension: 4\nspace: right-anterior-superior\nsizes: 6 " + size +
         "\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: 3D-symmetric-matrix space space space\n"
         "encoding: ascii\n\n" +
         numbers;
}

/// Makes a folder for each test, and removes it after the test.
class Program : public ::testing::Test {
 protected:
  Program() { std::filesystem::create_directories(folder_); }

  std::filesystem::path in_folder(const std::string& name) const { return folder_ / name; }

  /// Starts the program with the test's folder as working folder. @return its process.
  /// @param shell  Commands of the shell before the program; the last word runs it: "cd /; exec". "ulimit -f N; exec"
  /// is a full disk: no file has more than N blocks of 512 bytes.
  pid_t start(const Arguments& arguments, const std::string& shell = "exec") const {
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
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contents("stdout"), contents("stderr")};
  }

  Outcome run(const Arguments& arguments, const std::string& shell = "exec") const {
    return wait_for(start(arguments, shell));
  }

  /// Runs the program, which must succeed.
  Outcome run_well(const Arguments& arguments) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return outcome;
  }

  /// Runs a command of the shell with the test's folder as working folder.
  Outcome run_shell(const std::string& command) const {
    const int status =
        std::system(fmt::format("cd '{}' && {} >stdout 2>stderr", in_folder("").string(), command).c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents("stdout"), contents("stderr")};
  }

  /// The same with a script of tools/. @param variables  "NAME=VALUE ..." for it.
  Outcome run_script(const std::string& script, const std::string& arguments, const std::string& variables = "") const {
    return run_shell(fmt::format("{} '{}' {}", variables, (source_folder() / "tools" / script).string(), arguments));
  }

  /// An error of a user: one line on standard error that has `text`. @param status  0: any but success.
  static void expect_one_line(const Outcome& outcome, const std::string& text, int status = 0) {
    EXPECT_TRUE(status == 0 ? outcome.status != 0 : outcome.status == status) << outcome.status << outcome.error;
    EXPECT_THAT(outcome.error, HasSubstr(text));
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }

  /// Runs the program, which must end so and make no file.
  void expect_error(const std::string& text, const Arguments& arguments, int status = 0) const {
    const auto before = files();
    expect_one_line(run(arguments), text, status);
    EXPECT_EQ(files(), before);
  }

  bool has(const std::string& name) const { return std::filesystem::exists(in_folder(name)); }

  bool is_equal(const std::string& a, const std::string& b) const {
    return has(a) && has(b) && contents(a) == contents(b);
  }

  void write(const std::string& name, const std::string& text) const { write_bytes(in_folder(name), text); }

  /// Makes a pipe that nobody writes to: to open it would wait for ever.
  void make_pipe(const std::string& name) const {
    std::filesystem::create_directories(in_folder(name).parent_path());
    ASSERT_EQ(mkfifo(in_folder(name).c_str(), 0600), 0);
  }

  std::string contents(const std::string& name) const { return bytes_of(in_folder(name)); }
  std::vector<float> pixels(const std::string& picture) const { return read_image(in_folder(picture)).pixels; }
  json read_json(const std::string& name) const { return json::parse(contents(name)); }

  /// Names of the files in a folder, if it is there, except those that `run` makes.
  std::vector<std::string> files(const std::string& folder = "") const {
    std::vector<std::string> names;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(in_folder(folder), none)) {
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
