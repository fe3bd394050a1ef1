#pragma once
/// Reads VTK polydata (.vtp) with VTK, for programs without VTK (volumes/points/vtk_files.h).

#include <filesystem>
#include <set>
#include <string>

#include "volumes/points/vtk_files.h"

namespace tensorray {

/// Reads the polylines and the `wanted` numeric arrays, as doubles: see read_vtp_lines. VTK may end the process on
/// damaged files: call this in a child process.
/// @throw std::runtime_error with the reason (without the file).
PolylineData read_vtp_file(const std::filesystem::path& path, const std::set<std::string>& wanted);

}  // namespace tensorray
