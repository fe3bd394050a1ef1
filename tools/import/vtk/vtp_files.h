#pragma once
/// @file tools/import/vtk/vtp_files.h
/// VTK polydata (.vtp), read and written by VTK, for the programs that have none of it (volumes/files/vtk_files.h).

#include <filesystem>
#include <set>
#include <string>

#include "volumes/files/poly_data.h"

namespace tensorray {

/// Writes vertices (appended raw binary, LZ4) or polylines (appended raw binary, not compressed), in place.
/// @throw std::runtime_error with the reason (not the file), also when the disk is full.
void write_vtp_file(const std::filesystem::path& path, const PolyDataView& data);

/// Reads the polylines and the `wanted` arrays of numbers, as doubles: see read_vtp_lines. On damaged files VTK may end
/// the process: call it where that is survivable.
/// @throw std::runtime_error with the reason (not the file).
PolyData read_vtp_file(const std::filesystem::path& path, const std::set<std::string>& wanted);

}  // namespace tensorray
