#pragma once
/// Takes other programs' files without a separate import.

#include <filesystem>
#include <optional>
#include <vector>

#include "base/files/output_file.h"
#include "base/files/temporary_folder.h"
#include "tools/command_line/import_options.h"

namespace tensorray {

/// What a command line names: a scene, a field, or files of which an import makes a field, for as long as this lives.
class GivenField {
 public:
  /// Runs nothing yet, so that the rest of the command line can be checked first.
  /// @throw std::invalid_argument if a file that needs no import comes with others, or with choices.
  GivenField(std::vector<std::filesystem::path> files, ImportChoices choices);

  /// The first file, by which messages name the field.
  const std::filesystem::path& name() const { return files_.front(); }

  bool is_imported() const { return folder_.has_value(); }

  /// The field that `import` makes; empty: no import is needed.
  const std::filesystem::path& imported() const { return imported_; }

  /// The file to read.
  const std::filesystem::path& path() const { return is_imported() ? imported_ : name(); }

  /// The files that are read, and the mask, for require_distinct_files.
  std::vector<NamedFile> inputs() const;

  /// Runs `tensorray-import`, if that is needed, and prints its notes, unless `quiet` is set.
  /// @param memory  What it works with, bytes; 0: without a bound.
  /// @throw std::runtime_error with the import's error; Cancelled.
  void import(bool quiet, std::size_t memory = 0) const;

  /// For a scene that is to be saved. @throw std::invalid_argument with the fix if the field will not stay.
  void require_stays() const;

 private:
  std::vector<std::filesystem::path> files_;
  ImportChoices choices_;
  std::optional<TemporaryFolder> folder_;
  std::filesystem::path imported_;
};

/// Replaces this program by `tensorray-import`, which runs `tensorray import`, because only `tensorray-import`
/// contains VTK.
/// @param arguments  Those of main, from "import" on.
/// @throw std::runtime_error with the fix if `tensorray-import` is not built.
[[noreturn]] void become_import_program(char** arguments);

}  // namespace tensorray
