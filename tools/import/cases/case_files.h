#pragma once
/// Readers of files that VTK's readers take as they come: these check first whether the files are whole. All of them:
/// @throw std::runtime_error, one line that names the file and the fix.

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

/// EnSight's case files (EnSight 6 and Gold, ASCII and binary): all parts, with all variables. The components of
/// symmetric tensors have names. VTK's reader goes on for ever with some damaged cases, and repeats the last number of
/// a text that is cut off.
MeshFile open_ensight(const std::filesystem::path& path);

/// ExodusII: the undisplaced mesh with all variables; of a piece of Nemesis, those of all pieces. By default VTK moves
/// the points by any array that looks like a displacement. Variables that are not in the file, or not in the shape that
/// it announces, are left out, which the notes say: VTK returns memory that nobody wrote for them. Fill values, which
/// netCDF has where nothing was written, become NaN. A step after the first is an error if its time was not written, or
/// if a variable has more fill values there than at the first step and at the one before.
/// The format: https://sandialabs.github.io/seacas-docs/exodusII-new.pdf
MeshFile open_exodus(const std::filesystem::path& path);

/// All pieces of a mesh that was written in parallel: NAME.N.0, NAME.N.1, ... of N pieces. A file with another name is
/// the only one.
std::vector<std::filesystem::path> nemesis_pieces(const std::filesystem::path& path);

/// Checks that a classic netCDF file ("CDF" 1, 2 or 5) is as long as its header announces: the netCDF library reads
/// what is missing at its end as zeros. Leaves others (netCDF-4 is HDF5, which detects cut files) and damaged headers
/// to the library.
void require_whole_netcdf(const std::filesystem::path& path);

/// PLOT3D: a grid file and its q file, both in one form (one block, with or without the number of blocks and iblank;
/// raw or with Fortran record marks; either byte order; float or double). The result is a curvilinear grid with the
/// point arrays density, momentum, energy and velocity = momentum / density, which is NaN where the density is 0.
/// Blanked points (iblank 0) are ghost points. VTK's reader may end the process: call this in a child process.
vtkSmartPointer<vtkDataSet> read_plot3d(const std::filesystem::path& grid, const std::filesystem::path& q);

}  // namespace tensorray
