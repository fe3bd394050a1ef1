#pragma once
/// @file tools/import/program/import_command.h
/// The options of `tensorray import`, and its work.

namespace CLI {
class App;
}

namespace tensorray {

struct Progress;

/// Adds the options, and the import itself as what is done when they are parsed. Errors are exceptions: CLI::Error and
/// std::invalid_argument where the user's input is wrong.
void add_import_options(CLI::App& program, Progress& progress);

}  // namespace tensorray
