#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "tools/commands/commands.h"
#include "tools/commands/imported_field.h"

namespace tensorray {

void add_import_command(CLI::App& program) {
  program.add_subcommand("import", "Make a tensor field of another program's file");
}

void become_import_program(char** arguments) {
  const std::string program = import_program().string();
  arguments[0] = const_cast<char*>("tensorray-import");
  execv(program.c_str(), arguments);
  throw std::runtime_error(program + " cannot be started: " + std::generic_category().message(errno));
}

}  // namespace tensorray
