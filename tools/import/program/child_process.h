#pragma once
/// @file tools/import/program/child_process.h
/// Work with libraries that may end the process.

#include <functional>
#include <string>

#include "base/progress.h"

namespace tensorray {

/// Does `work` in a child process, and waits for it. What it changes in memory is lost; what it writes to files and
/// prints is not. The child says what `work` throws. To be called before the process has threads that `work` needs.
/// @param progress  If cancelled, the child is ended.
/// @param on_crash  What to say if the child was ended by a signal.
/// @throw Cancelled; CLI::RuntimeError with the child's exit status, if that is not 0; std::runtime_error(`on_crash`).
void in_child_process(const std::function<void()>& work, const Progress& progress, const std::string& on_crash);

}  // namespace tensorray
