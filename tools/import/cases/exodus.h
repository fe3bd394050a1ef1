#pragma once
/// @file tools/import/cases/exodus.h
/// Reads ExodusII files, and checks first which variables and steps they really have: VTK's reader returns memory that
/// nobody wrote for variables that are announced and missing, and netCDF's fill value for steps that were never
/// written. The format: https://sandialabs.github.io/seacas-docs/exodusII-new.pdf

#include <vector>

#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {

/// The undisplaced mesh with all variables; of a piece of Nemesis, those of all pieces. By default VTK moves the points
/// by any array that looks like a displacement. Variables that are not in the file, or not in the shape that it
/// announces, are left out, which the notes say. Fill values become NaN. A step after the first is an error if its
/// time was not written, or if a variable has more fill values there than at the first step and at the one before.
/// @throw std::runtime_error, one line that names the file and the fix.
MeshFile open_exodus(const std::filesystem::path& path);

/// All pieces of a mesh that was written in parallel: NAME.N.0, NAME.N.1, ... of N pieces. A file with another name is
/// the only one.
std::vector<std::filesystem::path> nemesis_pieces(const std::filesystem::path& path);

/// Checks that a classic netCDF file ("CDF" 1, 2 or 5) is as long as its header announces: the netCDF library reads
/// what is missing at its end as zeros. Leaves others (netCDF-4 is HDF5, which detects cut files) and damaged headers
/// to the library. @throw std::runtime_error naming the file.
void require_whole_netcdf(const std::filesystem::path& path);

}  // namespace tensorray
