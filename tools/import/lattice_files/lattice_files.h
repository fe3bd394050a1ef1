#pragma once
/// Readers of voxel files. All of them: @throw std::runtime_error, one line that names the file and the fix, if the
/// file is missing, has another format, is damaged or cut off, has sizes that do not fit its data, or has a transform
/// that cannot be inverted. Numbers that are not compressed are read from the file when they are needed, so that it
/// must not change meanwhile; compressed ones, and those of NRRD, are held in memory.
/// @param is_mask  The file must have one number at each voxel; only numbers and places of the lattice are of use.

#include <filesystem>

#include "tools/import/lattices/lattice.h"

namespace tensorray {

/// Reads NRRD and NHDR (Teem's nrrd; encodings raw, gzip, bzip2, ascii and hex; one data file). The data have three
/// spatial axes and one axis of 6, 7 (masked), 9, 10 (masked) or 3 (a vector) components, at any position among the
/// axes. World is right-anterior-superior (RAS) if the file's space is an anatomical one, else the file's own space.
/// The measurement frame rotates the components. Six components need an order from the user, unless their kind is a
/// symmetric matrix. Exactly zero is background. Teem takes memory for what a file announces: call this in a child
/// process. Threads: reads one file at a time.
Lattice open_nrrd(const std::filesystem::path& path, bool is_mask = false);

/// Reads NIfTI-1 and NIfTI-2 (.nii, .hdr with .img, also with .gz; of a pair either file may be given) with 6, 9 or 3
/// (a vector) volumes along the fourth or the fifth axis. World is RAS millimetres, from sform, else qform, else the
/// voxel sizes with the first axis from right to left. Applies scl_slope and scl_inter. The order is known if the
/// intent code is "symmetric matrix"; otherwise the user must give it. With the order `fsl` the components are in FSL's
/// axes of the image, as lower triangles in those of the voxels, otherwise in world axes. Exactly zero is background.
Lattice open_nifti(const std::filesystem::path& path, bool is_mask = false);

/// Reads MetaImage (.mha, .mhd with its data file; ITK) with three axes and 6, 9 or 3 (a vector) channels. World is
/// RAS, of the file's LPS. Components are in LPS unless the user gives the frame; six are xx xy xz yy yz zz unless the
/// user gives the order. Exactly zero is background.
Lattice open_metaimage(const std::filesystem::path& path, bool is_mask = false);

/// Reads MRtrix's images (.mif, .mif.gz, .mih with its data file) with 6, 9 or 3 (a vector) volumes along the fourth
/// axis. World is RAS millimetres. Six components are in the order `mrtrix` unless the user gives another one, in world
/// axes but for the orders `fsl` and `lower`, as in NIfTI. Exactly zero is background.
Lattice open_mrtrix(const std::filesystem::path& path, bool is_mask = false);

/// Reads NumPy's .npy of shape (nz, ny, nx, 3, 3), (nz, ny, nx, 9), (nz, ny, nx, 6) or (nz, ny, nx, 3), in C or
/// Fortran order, as float16, 32 or 64, in either byte order; masks are (nz, ny, nx), and may be integers or bool.
/// World coordinates are the voxel indices (i, j, k), which the caller may scale and move.
Lattice open_npy(const std::filesystem::path& path, bool is_mask = false);

}  // namespace tensorray
