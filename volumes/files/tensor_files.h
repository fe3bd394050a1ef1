#pragma once
/// @file volumes/files/tensor_files.h
/// Tensor fields in OpenVDB files. OpenVDB itself stays in the .cpp.

#include <filesystem>
#include <string>
#include <vector>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

/// How a tensor is made from a grid that holds none.
enum class Derive {
  none,      ///< The grids are the tensor's components.
  gradient,  ///< A Vec3 grid v: T(i, j) = ∂v_i/∂x_j, finite differences, world axes.
  hessian,   ///< A scalar grid f: T(i, j) = ∂²f/∂x_i∂x_j, finite differences, world axes.
};

/// What a VDB file holds, without its voxels.
struct GridInfo {
  std::string name;     ///< Made unique: the second of two grids "T" is "T[1]".
  std::string type;     ///< "vec3s", "float", ...
  std::string storage;  ///< "full", or "half" where the file stores 16-bit floats.
};

/// Reads a tensor field. Understood are three Vec3 grids NAME_row0, NAME_row1, NAME_row2 (the rows); nine scalar grids
/// NAME_0 … NAME_8 (row by row); scalar grids NAME.xx … NAME.zz, all nine or the six of a symmetric tensor (.xx .xy .xz
/// .yy .yz .zz); and with `derive` one Vec3 or scalar grid NAME. Single, half and double precision. A voxel is active
/// where any component is; other components are zero there.
/// @param name  Empty: the only tensor (or, with `derive`, the only suitable grid) in the file.
/// @return the grid with the file's metadata as text, and what the first grid has of `tensorray:...` that the file has
/// not. Values that are not finite are kept: see remove_non_finite.
/// @throw std::runtime_error, one line that names the file and the mend: missing, not a VDB, truncated, no such field
/// (the message lists the grids there are), several fields and no name, rows with different transforms, a transform
/// that is not affine, no active voxel.
TensorGrid read_tensor_vdb(const std::filesystem::path& path, const std::string& name = "",
                           Derive derive = Derive::none);

/// Writes the rows of a field as three Vec3S grids NAME_row0 … NAME_row2, vector type invariant, one transform, with
/// the grid's metadata on the file and on each grid.
/// The same grid gives the same bytes.
/// @param half  Store 16-bit floats: three significant digits between 6e-5 and 65504, steps of 6e-8 below.
/// @throw std::runtime_error naming the file and the reason (also when the disk is full; with `half`, when a value
/// exceeds 65504). The file is written in place.
void write_tensor_vdb(const std::filesystem::path& path, const TensorGrid& grid, bool half = false);

/// The same, giving back the grid's blocks on the way, so that there is never twice the field in memory.
void write_tensor_vdb(const std::filesystem::path& path, TensorGrid&& grid, bool half = false);

/// The grids of a file, in its order. @throw std::runtime_error as read_tensor_vdb.
std::vector<GridInfo> list_vdb(const std::filesystem::path& path);

/// The names of the tensor fields that read_tensor_vdb would find without `derive`.
std::vector<std::string> tensor_names(const std::vector<GridInfo>& grids);

}  // namespace tensorray
