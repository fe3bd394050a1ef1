#pragma once
/// Runs another program of this project, which is in the folder of the running program, or, where the running program
/// is another one's (an interpreter that has loaded this code), in a folder that is named.

#include <filesystem>
#include <string>
#include <vector>

#include "base/files/temporary_folder.h"

namespace tensorray {

/// The path by which a program that run_program starts can open the shared file.
constexpr const char* shared_file = "/proc/self/fd/3";

/// How a program ended.
struct ProgramEnd {
  int status = 0;     ///< Exit status.
  int signal = 0;     ///< The signal that ended the program, or 0.
  std::string error;  ///< The program's output to standard error.
};

/// Names the folder of this project's programs, for a process that is none of them; before other threads start work.
void use_programs_in(const std::filesystem::path& folder);

/// The path of a program of this project. The file need not exist.
std::filesystem::path sibling_program(const std::string& name);

/// Runs a program and waits for its end. The program shares the working folder, the environment, standard output, and
/// `shared` as `shared_file`. Its standard error is returned in ProgramEnd::error. Any thread may call this.
/// @throw std::runtime_error with the reason if the program cannot be started; Cancelled if SIGINT, SIGTERM or SIGHUP
/// ended it (Ctrl-C on a terminal reaches both programs).
ProgramEnd run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                       const UnnamedFile& shared);

/// Replaces the running program. @param arguments  As for execv; the first, its name, is set.
/// @throw std::runtime_error with the reason if the program cannot be started.
[[noreturn]] void become_program(const std::filesystem::path& program, char** arguments);

/// For a program that run_program started: makes it end when the program that started it ends.
void end_with_parent();

}  // namespace tensorray
