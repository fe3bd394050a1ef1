#pragma once
/// Paths as files. The file's ending selects the format.
///
/// `.vtp`, VTK polydata (ParaView): one polyline for each path. The file holds all data of a path. A path that is read
/// is the one that was written, bit for bit, and can be drawn without tracing again. Reading and writing need
/// `tensorray-import`; see volumes/points/vtk_files.h. The data are:
/// - point data, in double precision: `direction` (3), `length` (from the path's beginning), `tensor` (9, row by row),
///   `change` (3: V'); 0 or 1: `in_field`. Points are also in double precision: single precision would move them by
///   more than a millionth of a voxel where the origin is far away.
/// - point data computed from those, for other programs, in single precision: `force` (3: T V), `curvature` (|V'|),
///   `axis_major` and `axis_minor` (3: the semi-axes of Eq. 8, in the units of T: neither scaled nor clamped).
/// - cell data: `wavelength` (nm), `flexibility`, and `end` and `backward_end` (the number of the RayEnd; −1: not
///   followed backwards). The field data `end_names` are the names of the numbers, from 0 on.
///
/// `.tck`, tracks of MRtrix: only the positions, in single precision, in world units.

#include <filesystem>
#include <vector>

#include "tracing/paths/paths.h"

namespace tensorray {

/// Writes the file in place, in the order of `paths`. Paths without points, which other programs refuse, are left out.
/// @throw std::invalid_argument on another ending; std::runtime_error naming the file and the reason (also when the
/// disk is full).
void write_paths(const std::filesystem::path& path, const std::vector<Path>& paths);

/// Whether a file with this ending holds the tensors of the points.
bool stores_tensors(const std::filesystem::path& path);

/// Reads the files of write_paths and of other programs. A `.vtp` that lacks one of `direction`, `length`, `tensor`,
/// `change`, `in_field` (streamlines, for example) gives bare paths, as every `.tck` does: see bare_way. Polylines of
/// fewer than two different points are left out. A `.vtp` may have any encoding. Missing data are those of `Path`.
/// @throw std::invalid_argument on another ending; std::runtime_error naming the file and the reason: missing, damaged,
/// cut off, no path in it, a value that is not finite.
std::vector<Path> read_paths(const std::filesystem::path& path);

/// A path of which only the positions are known. Of points that coincide, one is kept. Directions, lengths and V' are
/// computed from the polyline (second order where points are dense); T = 0; all are in the field. Empty without two.
PathPoints bare_way(const std::vector<Eigen::Vector3d>& positions);

// One format each:

/// Write the file. @throw std::runtime_error naming the file and the reason.
void write_vtp_paths(const std::filesystem::path& path, const std::vector<Path>& paths);
void write_tck_paths(const std::filesystem::path& path, const std::vector<Path>& paths);

/// Read the file. @throw std::runtime_error with the reason (without the file's name).
std::vector<Path> read_vtp_paths(const std::filesystem::path& path);
std::vector<Path> read_tck_paths(const std::filesystem::path& path);

}  // namespace tensorray
