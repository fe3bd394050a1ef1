#pragma once
/// @file tools/commands/imported_field.h
/// Renders another program's file without a separate import.

#include <cstddef>
#include <filesystem>
#include <string>

#include "base/files/temporary_folder.h"

namespace tensorray {

/// The choices of an import that a render offers, as the options of `tensorray import`; empty: none.
struct ImportChoices {
  std::string order, array, gradient_of, frame;
  std::size_t memory = 0;  ///< What the making of the field works with, bytes; 0: no field in files.
};

/// Whether a path names a file that is neither a scene nor an OpenVDB file.
bool needs_import(const std::filesystem::path& path);

/// A field made of another program's file, for as long as this object lives.
class ImportedField {
 public:
  /// Runs `tensorray-import` and prints its notes, unless `quiet` is set.
  /// @throw std::runtime_error with the import's error; Cancelled.
  ImportedField(const std::filesystem::path& file, const ImportChoices& choices, bool quiet);

  const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

/// The program that imports. @throw std::runtime_error if it is not built.
std::filesystem::path import_program();

}  // namespace tensorray
