#pragma once
/// @file tools/import/cases/ensight_files.h
/// The files that a case of EnSight names, and whether they are whole: VTK's reader ends or goes on for ever with some
/// damaged cases, and repeats the last number of a text that is cut off. Private to the importer.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

class vtkDataObject;

namespace tensorray {

struct EnSightFile {
  std::string kind;  ///< As in the case: "model", "tensor symm per node", ...
  std::filesystem::path file;
};

struct EnSightCase {
  bool is_gold = true;
  std::vector<EnSightFile> files;
};

/// The files of geometry and variables at a time; without a time, the first ones. Those whose names cannot be told
/// (with spaces, or with numbers that are in files of their own) are left out.
/// @throw std::runtime_error: the case has a line that is no part of such a file; or names the file that is missing.
EnSightCase ensight_case(const std::filesystem::path& path, std::optional<double> time);

/// Checks that texts of EnSight Gold have as many numbers in their last part as a part of `read` has points or cells.
/// @throw std::runtime_error naming the file.
void check_ensight_ends(const EnSightCase& given, vtkDataObject& read);

}  // namespace tensorray
