#pragma once
/// @file tools/command_line/imported_field.h
/// Takes other programs' files without a separate import.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/files/temporary_folder.h"

namespace CLI {
class App;
}

namespace tensorray {

/// Options of `tensorray import` that other commands have, too, and their values; empty: not given.
using ImportChoices = std::map<std::string, std::string>;

/// Adds these options to a command. `choices` must outlive it.
void add_import_options(CLI::App& command, ImportChoices& choices);

/// These, and options that change the scene's field.
void add_field_options(CLI::App& command, ImportChoices& choices, std::vector<std::string>& overrides);

/// The options as they were given, each after a blank.
std::string flags_of(const ImportChoices& choices);

/// Whether a path names a file that is neither a scene nor an OpenVDB file.
bool needs_import(const std::filesystem::path& path);

/// A field made of another program's files, for as long as this object lives.
class ImportedField {
 public:
  /// Runs `tensorray-import` and prints its notes, unless `quiet` is set.
  /// @throw std::runtime_error with the import's error; Cancelled.
  ImportedField(const std::vector<std::filesystem::path>& files, const ImportChoices& choices, bool quiet);

  const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

/// For a file that needs no import. @throw std::invalid_argument if it comes with others, or with choices.
void refuse_import(const std::vector<std::filesystem::path>& files, const ImportChoices& choices);

/// Nothing if the first file needs no import. @throw as both of these.
std::optional<ImportedField> import_field(const std::vector<std::filesystem::path>& files, const ImportChoices& choices,
                                          bool quiet);

/// Replaces this program by `tensorray-import`, which runs `tensorray import`, because only `tensorray-import`
/// contains VTK.
/// @param arguments  Those of main, from "import" on.
/// @throw std::runtime_error with the fix if `tensorray-import` is not built.
[[noreturn]] void become_import_program(char** arguments);

}  // namespace tensorray
