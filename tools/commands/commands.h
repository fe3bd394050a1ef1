#pragma once
/// @file tools/commands/commands.h
/// The subcommands of the program, a file each. Each adds itself to `program`, and does its work when the command line
/// is parsed; errors are exceptions: CLI::Error, SceneError and std::invalid_argument where the user's input is wrong.

namespace CLI {
class App;
}

namespace tensorray {

struct Progress;

void add_render_command(CLI::App& program, Progress& progress);  ///< tensorray render SCENE.json: pictures of a scene.
void add_make_command(CLI::App& program, Progress& progress);    ///< tensorray make KIND: an analytic field.
void add_import_command(CLI::App& program);  ///< Names `import` in the list; become_import_program does it.
void add_derive_command(CLI::App& program, Progress& progress);   ///< tensorray derive FIELD.vdb: its invariants.
void add_stretch_command(CLI::App& program, Progress& progress);  ///< tensorray stretch SCENE.json: how light spreads.
void add_info_command(CLI::App& program);                         ///< tensorray info FILE.vdb: what a file holds.
void add_schema_command(CLI::App& program);                       ///< tensorray schema: the JSON Schema of scenes.

/// Replaces this program by `tensorray-import`, which does `tensorray import`: it alone needs VTK.
/// @param arguments  As main has them, from "import" on.
/// @throw std::runtime_error with the fix if `tensorray-import` is not built.
[[noreturn]] void become_import_program(char** arguments);

}  // namespace tensorray
