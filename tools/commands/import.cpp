#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "base/child_program.h"
#include "tools/commands/commands.h"

namespace tensorray {

void add_import_command(CLI::App& program) {
  program.add_subcommand("import", "Make a tensor field of another program's file");
}

void become_import_program(char** arguments) {
  const std::string program = sibling_program("tensorray-import").string();
  arguments[0] = const_cast<char*>("tensorray-import");
  execv(program.c_str(), arguments);
  if (errno == ENOENT)
    throw std::runtime_error("imports need " + program + ", which is not built; run `tools/setup release import`");
  throw std::runtime_error(program + " cannot be started: " + std::generic_category().message(errno));
}

}  // namespace tensorray
