#pragma once
/// @file volumes/files/scalar_files.h
/// Grids of numbers in OpenVDB files, for any tool that reads these. OpenVDB itself stays in the .cpp.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// Writes each grid as an OpenVDB float grid (background 0), with its metadata on it, and `metadata` on the file.
/// The same grids give the same bytes.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full. The file is written in place.
void write_scalar_vdb(const std::filesystem::path& path, const std::vector<ScalarGrid>& grids,
                      const std::map<std::string, std::string>& metadata);

}  // namespace tensorray
