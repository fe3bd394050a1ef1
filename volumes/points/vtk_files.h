#pragma once
/// @file volumes/points/vtk_files.h
/// Points and polylines as VTK polydata (.vtp). Reading starts another program, `tensorray-import`, which contains VTK.
/// Rendering therefore needs no VTK, and where VTK prints or ends the process because a file is damaged, the caller
/// gets an exception. The programs exchange the data in a file without a name (poly_data.h).

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "volumes/points/point_files.h"
#include "volumes/points/poly_data.h"

namespace tensorray {

/// Polylines, and named values for their points and for themselves.
struct PolylineData {
  std::vector<Eigen::Vector3d>
      points;  ///< World positions: all points of the first line, then those of the next line, ...
  std::vector<std::size_t> line_ends;  ///< For each line: the number of points up to its end, earlier lines included.
  std::map<std::string, DataArray> point_data, line_data;  ///< One value per point, and one value per line.
  std::map<std::string, std::vector<std::string>>
      texts;  ///< Field data: notes about the whole file. Written, but not read.
};

/// Writes one vertex per point, the scalars and vectors as point data, and the metadata as string field data;
/// encoding: binary (base64), not compressed.
/// @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vtp(const std::filesystem::path& path, const PointCloud& points);

/// Writes polylines with points in double precision, in the same encoding. @throw as above.
void write_vtp(const std::filesystem::path& path, const PolylineData& lines);

/// Reads the polylines of a .vtp file in any of VTK's encodings (ASCII, binary or appended; compressed or not; either
/// byte order; any number of pieces), and those of the `wanted` numeric arrays that the file has, as doubles. Ignores
/// everything else. Points that several lines share are repeated; points of no line are dropped.
/// @throw std::runtime_error with the reason (without the file): not VTK polydata, damaged or cut off, a line refers
/// to a point that does not exist, the file announces more than memory holds; Cancelled.
PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted);

}  // namespace tensorray
