#pragma once
/// @file tools/import/vtk_formats/netcdf_end.h
/// Finds netCDF files that are cut off: the netCDF library reads missing data at the end of a file as zeros.

#include <filesystem>

namespace tensorray {

/// Checks that a classic netCDF file ("CDF" 1, 2 or 5; ExodusII files are such files) is as long as its header
/// announces. Leaves others (netCDF-4 is HDF5, which detects cut files) and damaged headers to the library.
/// @throw std::runtime_error naming the file.
void require_whole_netcdf(const std::filesystem::path& path);

}  // namespace tensorray
