#pragma once
/// @file volumes/points/poly_data.h
/// Polylines with named values, and the file in which `tensorray-import` hands them to this program. Users never see
/// this file: its numbers have the machine's byte order, and both programs must have the same version.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

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

/// Writes the file in place, without texts. All arrays are of doubles.
/// @throw std::runtime_error with the reason (without the file) when the disk is full.
void write_poly_lines(const std::filesystem::path& path, PolylineData lines);

/// @throw std::runtime_error with the reason (without the file) if the file is of another kind or is cut off.
PolylineData read_poly_lines(const std::filesystem::path& path);

}  // namespace tensorray
