#pragma once
/// @file volumes/files/vtk_files.h
/// Points and polylines as VTK polydata (.vtp). VTK itself stays in the .cpp; it writes, but does not read: VTK 9.1
/// uses memory that it never set, prints, or ends the program on files that are damaged or cut off.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "volumes/files/point_files.h"

namespace tensorray {

/// Values of `components` numbers each, one value after another, in the type that the file has or shall have.
struct DataArray {
  int components = 1;
  std::variant<std::vector<double>, std::vector<float>, std::vector<std::int32_t>, std::vector<std::uint8_t>> values;
};

/// Polylines, and named values for their points and for themselves.
struct PolylineData {
  std::vector<Eigen::Vector3d> points;  ///< World; those of the first line, then those of the next one, ...
  std::vector<std::size_t> line_ends;   ///< For each line, how many points it and those before have.
  std::map<std::string, DataArray> point_data, line_data;  ///< A value a point, and a value a line.
  std::map<std::string, std::vector<std::string>> texts;   ///< Field data: notes to the whole file. Not read.
};

/// Writes a vertex a point, its scalars and vectors as point data and the metadata as string field data; appended raw
/// binary, LZ4. @throw std::runtime_error naming the file and the reason, also when the disk is full.
void write_vtp(const std::filesystem::path& path, const PointCloud& points);

/// Writes polylines; appended raw binary, not compressed, which the most programs read. Points are double precision.
/// @throw as above.
void write_vtp(const std::filesystem::path& path, const PolylineData& lines);

/// Reads the polylines of a .vtp file as VTK, ParaView and others write it (ASCII, or binary that is little-endian and
/// not compressed, inline or appended, raw or base64; in any number of pieces), and what it has of the `wanted` arrays
/// of numbers, as doubles; passes over all else. Points that lines share are repeated, those of no line are dropped.
/// No memory is taken for what a file announces and does not hold.
/// @throw std::runtime_error with the reason (not the file): not VTK polydata, compressed, big-endian, damaged or cut
/// off, a line names a point that is not there.
PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted);

}  // namespace tensorray
