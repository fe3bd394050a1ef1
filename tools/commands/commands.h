#pragma once
/// The subcommands of the program, one per file. Each function adds a subcommand to `program`, which does its work
/// while the command line is parsed. Errors are exceptions: CLI::Error, SceneError and std::invalid_argument where
/// the user's input is wrong.

namespace CLI {
class App;
}

namespace tensorray {

struct Progress;

void add_render_command(CLI::App& program, Progress& progress);   ///< tensorray render SCENE.json: pictures of a scene.
void add_explore_command(CLI::App& program, Progress& progress);  ///< tensorray explore FIELD.vdb: a sheet of pictures.
void add_merge_command(CLI::App& program, Progress& progress);    ///< tensorray merge SHARD...: pictures of shards.
void add_make_command(CLI::App& program, Progress& progress);     ///< tensorray make KIND: an analytic field.
void add_derive_command(CLI::App& program, Progress& progress);   ///< tensorray derive FIELD.vdb: its invariants.
void add_info_command(CLI::App& program);                         ///< tensorray info FILE.vdb: what a file holds.
void add_schema_command(CLI::App& program);                       ///< tensorray schema: the JSON Schema of scenes.

}  // namespace tensorray
