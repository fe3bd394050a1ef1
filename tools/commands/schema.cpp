#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "integrators/methods/read_scene.h"
#include "tools/commands/commands.h"

namespace tensorray {

void add_schema_command(CLI::App& program) {
  CLI::App* command = program.add_subcommand("schema", "Print the JSON Schema of scene files");
  command->callback([] { fmt::print("{}\n", scene_schema(SchemaKind::with_keyframes)); });
}

}  // namespace tensorray
