#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "base/process/child_program.h"
#include "tools/commands/commands.h"

namespace tensorray {

void add_view_command(CLI::App& program) {
  program.add_subcommand("view", "Look at a scene in a browser and change it there");
}

void become_view_program(char** arguments) {
  const std::filesystem::path program = sibling_program("tensorray-view");
  if (!std::filesystem::exists(program))
    throw std::runtime_error("the view needs " + program.string() + ", which is not built; start it with `tools/view`");
  become_program(program, arguments);
}

}  // namespace tensorray
