#pragma once
/// @file tools/import/vtk/netcdf_size.h
/// How long a netCDF file must be. Its library reads what is missing at the end as zeros.

#include <cstdint>
#include <filesystem>
#include <optional>

namespace tensorray {

/// The length that the header of a classic netCDF file ("CDF" 1, 2 or 5; ExodusII files are such) asks for, in bytes;
/// nothing if it is no classic file (netCDF-4 is HDF5, which notices) or its header is cut off or damaged.
std::optional<std::uint64_t> netcdf_size(const std::filesystem::path& path);

}  // namespace tensorray
