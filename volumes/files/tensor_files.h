#pragma once
/// Tensor fields, and grids of numbers, in OpenVDB files. Only the .cpp file includes OpenVDB.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "volumes/files/grid_layouts.h"
#include "volumes/grids/block_source.h"
#include "volumes/vdb/vdb_compression.h"

namespace tensorray {

/// A tensor field of the grids that field_grids (grid_layouts.h) finds. Its blocks are read when they are needed; the
/// file stays open. Precision is single, half or double. A voxel is active where any component is active; the inactive
/// components are zero there. With Derive::gradient, a vector grid of the class "staggered" has component i on the
/// voxels' faces towards −i, and is differentiated there. Derived tensors are in memory.
/// @param name  Empty: the only tensor (or, with `derive`, the only suitable grid) in the file.
/// @param components  The grids that are the components; empty: they are found by their names.
/// @return the blocks, with the surface, and the file's metadata as text. Entries `tensorray:...` that the file lacks
/// are taken from the first grid. `tensorray:units` of derivatives is the first grid's with "/length" or "/length^2"; a
/// stress has the unit of its gradient. Values that are not finite are kept: see remove_non_finite.
/// @throw std::runtime_error, one line that names the file and the fix: missing, not a VDB, truncated, no such field
/// (the message lists the grids of the file), several fields and no name, rows with different transforms, a transform
/// that is not affine, no active voxel, levels that do not fit to each other. Damage within the values of voxels shows
/// when blocks are read.
BlockSource open_tensor_vdb(const std::filesystem::path& path, const std::string& name = "",
                            Derive derive = Derive::none, const ComponentGrids& components = {});

/// The same with all blocks in memory.
TensorGrid read_tensor_vdb(const std::filesystem::path& path, const std::string& name = "",
                           Derive derive = Derive::none, const ComponentGrids& components = {});

/// Writes the rows of a field as three Vec3S grids NAME_row0 … NAME_row2 with vector type "invariant" and one
/// transform; its surface, if it has one, as two more (surface_grids.h). Writes the grid's metadata on the file and on
/// each grid. Finer levels are grids of the same layout, NAME_row0@1 … with half, a quarter, … of the voxel size.
/// Equal grids give equal bytes. Writes the file in place, block by block, so that memory does not hold the
/// field twice.
/// @param half  Store 16-bit floats: three significant digits between 6e-5 and 65504, steps of 6e-8 below.
/// @throw std::runtime_error naming the file and the reason (also when the disk is full; with `half`, when a value
/// exceeds 65504).
void write_tensor_vdb(const std::filesystem::path& path, const TensorGrid& grid, bool half = false,
                      VdbCompression compression = VdbCompression::blosc);

/// The grids of a file, in the file's order. @throw std::runtime_error as open_tensor_vdb.
std::vector<GridInfo> list_vdb(const std::filesystem::path& path);

/// Writes each grid as an OpenVDB float grid (background 0) with its own metadata, and writes `metadata` on the file.
/// @param surface  Of the body that they are in; each gets it.
/// Equal grids give equal bytes. Writes the file in place.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_scalar_vdb(const std::filesystem::path& path, const std::vector<ScalarGrid>& grids,
                      const std::map<std::string, std::string>& metadata, const TriangleMesh& surface = {});

}  // namespace tensorray
