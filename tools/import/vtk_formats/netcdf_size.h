#pragma once
/// @file tools/import/vtk_formats/netcdf_size.h
/// Computes how long a netCDF file must be. The netCDF library reads missing data at the end of a file as zeros.

#include <cstdint>
#include <filesystem>
#include <optional>

namespace tensorray {

/// The length in bytes that the header of a classic netCDF file announces ("CDF" 1, 2 or 5; ExodusII files are such
/// files). Empty if the file is not classic (netCDF-4 is HDF5, which detects cut files), or if its header is cut off
/// or damaged.
std::optional<std::uint64_t> netcdf_size(const std::filesystem::path& path);

}  // namespace tensorray
