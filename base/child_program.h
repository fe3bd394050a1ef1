#pragma once
/// @file base/child_program.h
/// Runs another program of this project, which lies beside the running one.

#include <filesystem>
#include <string>
#include <vector>

namespace tensorray {

/// A file in the temporary folder that has no name, so that nothing is left of it when the last process that holds it
/// ends, however that ends. Starts empty.
class UnnamedFile {
 public:
  /// @throw std::runtime_error naming the temporary folder.
  UnnamedFile();
  ~UnnamedFile();
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;

  /// By which this process, and only it, can open the file.
  std::filesystem::path path() const;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

/// By which a program that run_program started can open the file that was shared with it.
constexpr const char* shared_file = "/proc/self/fd/3";

/// How a program ended.
struct ProgramEnd {
  int status = 0;     ///< Exit status.
  int signal = 0;     ///< The signal that ended it, or 0.
  std::string error;  ///< What it wrote to standard error.
};

/// Where a program of this project lies: in the folder of the running one. It need not exist.
std::filesystem::path sibling_program(const std::string& name);

/// Runs a program and waits for it. It shares the working folder, the environment, standard output, and `shared` as
/// `shared_file`; its standard error is kept. Any thread may call this.
/// @throw std::runtime_error with the reason if it cannot be started; Cancelled if SIGINT or SIGTERM ended it: Ctrl-C
/// on a terminal reaches it too.
ProgramEnd run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                       const UnnamedFile& shared);

/// In a program that run_program started: have it end when the one that started it ends.
void end_with_parent();

}  // namespace tensorray
