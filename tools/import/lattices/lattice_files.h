#pragma once
/// @file tools/import/lattices/lattice_files.h
/// Files of voxels. All: @throw std::runtime_error, one line that names the file and the mend: missing, of another
/// format, damaged or cut off, sizes that do not fit the data, a transform that cannot be inverted, no memory taken for
/// what a file announces and does not hold.

#include <filesystem>

#include "tools/import/lattices/lattice.h"

namespace tensorray {

/// NRRD and NHDR (Teem's nrrd; raw, gzip, bzip2, ascii, hex; one data file): three axes of space and one of 6, 7
/// (masked), 9 or 10 (masked) components, wherever it stands among the axes, or of 3 (a vector). World is the file's
/// space turned to right-anterior-superior (RAS) where it is one of the anatomical ones, and the file's own otherwise.
/// The measurement frame turns the components. Six ask for their order unless their kind is a symmetric matrix. Exactly
/// zero is background. The numbers are held, and given back slice by slice where z is the slowest axis. One at a time.
Lattice open_nrrd(const std::filesystem::path& path);

/// NIfTI-1 and -2 (.nii, .nii.gz, .hdr/.img) of 6 volumes, 9, or 3 (a vector), along the fourth axis or the fifth.
/// World is RAS millimetres, by sform, or qform, or voxel sizes. scl_slope and scl_inter are applied. The order is
/// known where the intent code says symmetric matrix, and asked for otherwise. With `fsl` the components are in FSL's
/// axes of the image (Lattice::fsl_frame), else in world axes. Exactly zero is background. The numbers are held, and
/// given back slice by slice.
Lattice open_nifti(const std::filesystem::path& path);

/// NumPy's .npy of shape (nz, ny, nx, 3, 3), (nz, ny, nx, 9), (nz, ny, nx, 6) or (nz, ny, nx, 3); C or Fortran order,
/// float16, 32 or 64, either byte order. Voxels are at their indices: (i, j, k) in units of one. Slices are read from
/// the file, which must stay as it is, when they are asked for.
Lattice open_npy(const std::filesystem::path& path);

}  // namespace tensorray
