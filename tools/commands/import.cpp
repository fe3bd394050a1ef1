#include <cstdlib>

#include <CLI/CLI.hpp>

#include "base/process/child_program.h"
#include "tools/commands/commands.h"
#include "tools/commands/imported_field.h"

namespace tensorray {

void add_import_command(CLI::App& program) {
  program.add_subcommand("import", "Make a tensor field of another program's file");
}

void become_import_program(char** arguments) {
  // A library that VTK may bring (UCX, of MPI) otherwise prints a trace of calls when the reader of a damaged file
  // crashes; tensorray says it in one line.
  setenv("UCX_HANDLE_ERRORS", "none", 0);
  become_program(import_program(), arguments);
}

}  // namespace tensorray
