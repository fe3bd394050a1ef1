#pragma once
/// @file tools/import/cases/ensight.h
/// Reads EnSight's case files (EnSight 6 and Gold, ASCII and binary), and checks first whether they are whole: VTK's
/// reader goes on for ever with some damaged cases, and repeats the last number of a text that is cut off. Private to
/// the importer.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

class vtkDataObject;
template <class T>
class vtkSmartPointer;

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

/// The times of a case, in order; none if it has no time sets.
std::vector<double> ensight_times(const std::filesystem::path& path);

/// All parts, with all variables, at a step of time, from 0 on. Symmetric tensors are in VTK's order.
vtkSmartPointer<vtkDataObject> read_ensight(const std::filesystem::path& path, int step);

}  // namespace tensorray
