#pragma once
/// @file volumes/files/vtk_files.h
/// Points and polylines as VTK polydata (.vtp). VTK itself is in another program, `tensorray-import`, which these
/// functions start: rendering needs no VTK, and what VTK does to damaged files (it prints, or ends the process) is an
/// error here. The data go there and come back in a file without a name (poly_data.h).

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "volumes/files/point_files.h"
#include "volumes/files/poly_data.h"

namespace tensorray {

/// Polylines, and named values for their points and for themselves.
struct PolylineData {
  std::vector<Eigen::Vector3d> points;  ///< World; those of the first line, then those of the next one, ...
  std::vector<std::size_t> line_ends;   ///< For each line, how many points it and those before have.
  std::map<std::string, DataArray> point_data, line_data;  ///< A value a point, and a value a line.
  std::map<std::string, std::vector<std::string>> texts;   ///< Field data: notes to the whole file. Not read.
};

/// So that work whose result goes into a .vtp file, or that needs one, is not begun in vain.
/// @throw std::runtime_error with the fix if `tensorray-import` is not built.
void require_vtk_program();

/// Writes a vertex a point, its scalars and vectors as point data and the metadata as string field data; appended raw
/// binary, LZ4. @throw std::runtime_error naming the file and the reason, also when the disk is full; Cancelled.
void write_vtp(const std::filesystem::path& path, const PointCloud& points);

/// Writes polylines; appended raw binary, not compressed, which the most programs read. Points are double precision.
/// @throw as above.
void write_vtp(const std::filesystem::path& path, const PolylineData& lines);

/// Reads the polylines of a .vtp file in any of VTK's encodings (ASCII, binary or appended; compressed or not; either
/// byte order; in any number of pieces), and what it has of the `wanted` arrays of numbers, as doubles; passes over all
/// else. Points that lines share are repeated, those of no line are dropped.
/// @throw std::runtime_error with the reason (not the file): not VTK polydata, damaged or cut off, a line names a point
/// that is not there, more announced than memory holds; Cancelled.
PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted);

}  // namespace tensorray
