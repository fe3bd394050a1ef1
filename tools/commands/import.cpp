#include <CLI/CLI.hpp>

#include "base/child_program.h"
#include "tools/commands/commands.h"
#include "tools/commands/imported_field.h"

namespace tensorray {

void add_import_command(CLI::App& program) {
  program.add_subcommand("import", "Make a tensor field of another program's file");
}

void become_import_program(char** arguments) { become_program(import_program(), arguments); }

}  // namespace tensorray
