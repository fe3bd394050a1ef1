#pragma once
/// @file volumes/files/scalar_files.h
/// Grids of numbers in OpenVDB files, for any tool that reads such files. Only the .cpp file includes OpenVDB.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// Writes each grid as an OpenVDB float grid (background 0) with its own metadata, and writes `metadata` on the file.
/// Equal grids give equal bytes. Writes the file in place.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_scalar_vdb(const std::filesystem::path& path, const std::vector<ScalarGrid>& grids,
                      const std::map<std::string, std::string>& metadata);

}  // namespace tensorray
