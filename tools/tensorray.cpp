/// The program `tensorray`: selects the command.
///   tensorray --read-mesh EXCHANGE FILE    a mesh → the file that renderer/meshes/assimp_mesh.cpp reads, which alone
///                                          uses this

#include <filesystem>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/process/child_program.h"
#include "renderer/meshes/mesh_readers.h"
#include "tools/command_line/imported_field.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/commands/commands.h"

namespace {

/// Replaces this program by the one that contains the web server.
[[noreturn]] void become_view_program(char** arguments) {
  const std::filesystem::path program = tensorray::sibling_program("tensorray-view");
  if (!std::filesystem::exists(program))
    throw std::runtime_error("the view needs " + program.string() + ", which is not built; start it with `tools/view`");
  tensorray::become_program(program, arguments);
}

/// For an unknown command, CLI11 only reports that a command is required.
void require_known_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::string known;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == argv[1]) return;
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  throw std::invalid_argument(fmt::format("unknown command `{}`; there are {}", argv[1], known));
}

}  // namespace

int main(int argc, char** argv) {
  tensorray::open_standard_streams();
  if (argc == 4 && std::string(argv[1]) == "--read-mesh")
    return tensorray::answer_parent([&] { tensorray::write_assimp_mesh(argv[3], argv[2]); });
  tensorray::Progress& progress = tensorray::progress_until_interrupted();
  if (argc > 1 && std::string(argv[1]) == "import")
    return tensorray::run_and_report([&] { tensorray::become_import_program(argv + 1); });
  if (argc > 1 && std::string(argv[1]) == "view")
    return tensorray::run_and_report([&] { become_view_program(argv + 1); });

  CLI::App app("tensorray: light through tensor fields (Zheng and Pang 2003)", "tensorray");
  app.set_version_flag("--version", "tensorray " TENSORRAY_VERSION);
  app.require_subcommand(1);
  tensorray::add_render_command(app, progress);
  tensorray::add_merge_command(app, progress);
  tensorray::add_explore_command(app, progress);
  app.add_subcommand("view", "Look at a scene in a browser and change it there");
  tensorray::add_make_command(app, progress);
  tensorray::add_derive_command(app, progress);
  app.add_subcommand("import", "Make a tensor field of another program's file");
  tensorray::add_info_command(app);
  tensorray::add_schema_command(app);
  return tensorray::run_and_report([&] {
    require_known_command(app, argc, argv);
    tensorray::parse(app, argc, argv);
  });
}
