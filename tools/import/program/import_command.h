#pragma once
/// @file tools/import/program/import_command.h
/// The options of `tensorray import`, and the command itself.

namespace CLI {
class App;
}

namespace tensorray {

struct Progress;

/// Adds the options to `program`. The import runs when they are parsed. Errors are exceptions: CLI::Error and
/// std::invalid_argument where the user's input is wrong.
void add_import_options(CLI::App& program, Progress& progress);

}  // namespace tensorray
