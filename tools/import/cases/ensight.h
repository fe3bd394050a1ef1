#pragma once
/// @file tools/import/cases/ensight.h
/// Reads EnSight's case files (EnSight 6 and Gold, ASCII and binary), and checks first whether they are whole: VTK's
/// reader goes on for ever with some damaged cases, and repeats the last number of a text that is cut off.

#include <string>
#include <vector>

#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {

struct EnSightFile {
  std::string kind;  ///< As in the case: "model", "tensor symm per node", ...
  std::filesystem::path file;
};

struct EnSightCase {
  bool is_gold = true;
  std::vector<float> times;  ///< Of all time sets, in order; VTK has them in single precision.
  std::vector<EnSightFile> files;
};

/// The files of geometry and variables at a step of `times`. Those whose names cannot be told (with spaces, or with
/// numbers that are in files of their own) are left out.
/// @throw std::runtime_error: the case has a line that is no part of such a file; or names the file that is missing.
EnSightCase ensight_case(const std::filesystem::path& path, std::size_t step);

/// All parts, with all variables. The components of symmetric tensors have names.
MeshFile open_ensight(const std::filesystem::path& path);

}  // namespace tensorray
