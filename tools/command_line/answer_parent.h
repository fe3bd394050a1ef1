#pragma once
/// @file tools/command_line/answer_parent.h
/// The other side of run_program (base/process/child_program.h).

#include <functional>

namespace tensorray {

/// Does `work` for the program that started this one, ends with it, and takes no more memory than there is. Prints an
/// error as one line, without the program's name. @return the exit status.
int answer_parent(const std::function<void()>& work);

}  // namespace tensorray
