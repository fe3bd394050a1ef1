#pragma once
/// Isolates work with libraries that may end the process.

#include <functional>
#include <string>

#include "base/process/progress.h"

namespace tensorray {

/// Runs `work` in a child process and waits for it. Changes to memory are lost; files and printed output remain. The
/// child prints the errors that `work` throws. Call this before the process has threads that `work` needs.
/// @param progress  If cancelled, the child gets SIGTERM.
/// @param on_crash  The error message if a signal ended the child.
/// @throw Cancelled; CLI::RuntimeError with the child's exit status, if it is not 0; std::runtime_error(`on_crash`).
void in_child_process(const std::function<void()>& work, const Progress& progress, const std::string& on_crash);

}  // namespace tensorray
