#pragma once
/// Points and polylines as VTK polydata (.vtp). Reading starts another program, `tensorray-import`, which contains VTK.
/// Rendering therefore needs no VTK, and where VTK prints or ends the process because a file is damaged, the caller
/// gets an exception.

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "volumes/points/point_files.h"

namespace tensorray {

/// Values of `components` numbers each, one value after another, in the number type of the file.
struct DataArray {
  int components = 1;
  std::variant<std::vector<double>, std::vector<float>, std::vector<std::int32_t>, std::vector<std::uint8_t>> values;
};

/// Polylines, and named values for their points and for themselves.
struct PolylineData {
  std::vector<Eigen::Vector3d> points;  ///< World: all of the first line, then those of the next one, ...
  std::vector<std::size_t> line_ends;   ///< For each line: the number of points up to its end, earlier lines included.
  std::map<std::string, DataArray> point_data, line_data;  ///< One value per point, and one value per line.
  std::map<std::string, std::vector<std::string>> texts;   ///< Notes about the whole. Written, but not read.
};

/// Writes one vertex per point, the scalars and vectors as point data, and the metadata as string field data; in place,
/// on all threads, and without VTK, which takes four times as long. Arrays are inline, in base64 and not compressed,
/// which most programs can read: data at the end of the file stop Debian 12's ParaView, whose libexpat is newer than
/// itself. @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vtp(const std::filesystem::path& path, const PointCloud& points);

/// Writes polylines in the same way, and the texts as string field data. @throw as above.
void write_vtp(const std::filesystem::path& path, const PolylineData& lines);

/// Reads the polylines of a .vtp file in any of VTK's encodings (ASCII, binary or appended; compressed or not; either
/// byte order; any number of pieces), and those of the `wanted` numeric arrays that the file has, as doubles. Ignores
/// everything else. Points that several lines share are repeated; points of no line are dropped.
/// @throw std::runtime_error with the reason (without the file): not VTK polydata, damaged or cut off, a line refers
/// to a point that does not exist, the file announces more than memory holds; Cancelled.
PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted);

// The file without a name in which `tensorray-import` hands polylines to this program. Users never see it: its numbers
// have the machine's byte order, and both programs must have the same version.

/// Writes the file in place, without texts. All arrays are of doubles.
/// @throw std::runtime_error with the reason (without the file) when the disk is full.
void write_poly_lines(const std::filesystem::path& path, PolylineData lines);

/// @throw std::runtime_error with the reason (without the file) if the file is of another kind or is cut off.
PolylineData read_poly_lines(const std::filesystem::path& path);

}  // namespace tensorray
