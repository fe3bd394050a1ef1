#pragma once
/// @file tools/import/cases/ensight.h
/// Reads EnSight's case files (EnSight 6 and Gold, ASCII and binary). Private to the importer.

#include <filesystem>
#include <optional>
#include <vector>

class vtkDataObject;
template <class T>
class vtkSmartPointer;

namespace tensorray {

/// The times of a case, in order; none if it has no time sets.
std::vector<double> ensight_times(const std::filesystem::path& path);

/// All parts, with all variables, at a time; none: of a case without times. Symmetric tensors have the names of their
/// components.
vtkSmartPointer<vtkDataObject> read_ensight(const std::filesystem::path& path, std::optional<double> time);

}  // namespace tensorray
