#pragma once
/// The options of `tensorray import` that all commands have which take other programs' files.

#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tensorray {

/// The options that were given, each with its values; a flag has none.
using ImportChoices = std::map<std::string, std::vector<std::string>>;

/// Adds the options to a command. `choices` must outlive it. Only `tensorray-import` knows the words of --order and
/// --frame.
void add_import_options(CLI::App& command, ImportChoices& choices);

/// These, and options that change the scene's field.
void add_field_options(CLI::App& command, ImportChoices& choices, std::vector<std::string>& overrides);

/// The options as they were given, each after a blank.
std::string flags_of(const ImportChoices& choices);

}  // namespace tensorray
