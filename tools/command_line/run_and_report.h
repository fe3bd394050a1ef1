#pragma once
/// How the programs end: errors as one line and an exit status, and signals.

#include <exception>
#include <functional>
#include <stdexcept>
#include <string>

#include "base/process/progress.h"

namespace CLI {
class App;
}

namespace tensorray {

/// Work that was interrupted, and kept what it had: exit status 130.
struct Interrupted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What an error says to the user, on one line: libraries' texts are put into words.
std::string reason_of(const std::exception& error);

/// Calls `work`, and prints an exception that it throws as one line on standard error.
/// @return the exit status: 0 done, 1 failed, 2 the command line or the scene is wrong, 130 interrupted.
int run_and_report(const std::function<void()>& work);

/// Parses a program's arguments. @return false if they asked for help or the version, which is printed.
bool parse(CLI::App& program, int argc, char** argv);

/// The value of an option as a part from 0 to 1: "1%" or "0.01". @throw std::invalid_argument
double part_of(const std::string& text, const std::string& option);

/// The same as run_and_report for the program that started this one with run_program (base/process/child_program.h):
/// ends with it, takes no more memory than there is, and prints an error without the program's name.
int answer_parent(const std::function<void()>& work);

/// Makes SIGINT (Ctrl-C) and SIGTERM cancel the returned progress, which lives as long as the program. A second
/// signal ends the program at once. Broken pipes and file-size limits become errors of the write that meets them.
Progress& progress_until_interrupted();

/// Whether SIGUSR1, which asks for a picture of what there is so far, has come since the last call. It does nothing
/// else.
bool take_picture_request();

}  // namespace tensorray
