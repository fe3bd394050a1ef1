#pragma once
/// @file tools/commands/imported_field.h
/// Renders another program's file without a separate import.

#include <filesystem>
#include <map>
#include <string>

#include "base/files/temporary_folder.h"

namespace tensorray {

/// Options of `tensorray import` that a render has, too, and their values; empty: not given.
using ImportChoices = std::map<std::string, std::string>;

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

}  // namespace tensorray
