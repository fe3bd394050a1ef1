#pragma once
/// @file tests/structure/commands.h
/// Runs commands of the shell, for tests of scripts.

#include <array>
#include <cstdio>
#include <string>

#include <sys/wait.h>

#include "tests/data_folder.h"

namespace tensorray::test {

struct CommandResult {
  std::string output;
  int status = -1;
};

inline CommandResult run_command(const std::string& command) {
  CommandResult result;
  FILE* const pipe = popen(command.c_str(), "r");
  std::array<char, 4096> buffer;
  while (const std::size_t size = fread(buffer.data(), 1, buffer.size(), pipe))
    result.output.append(buffer.data(), size);
  result.status = WEXITSTATUS(pclose(pipe));
  return result;
}

}  // namespace tensorray::test
