#pragma once
/// @file volumes/files/poly_data.h
/// Points or polylines with named values, and the file in which this program and `tensorray-import` hand them to each
/// other. The file is no format for users: numbers have the machine's byte order, and both programs are of one version.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace tensorray {

/// Values of `components` numbers each, one value after another, in the type that the file has or shall have.
struct DataArray {
  int components = 1;
  std::variant<std::vector<double>, std::vector<float>, std::vector<std::int32_t>, std::vector<std::uint8_t>> values;
};

template <class Number>
struct NumberSpan {
  const Number* data = nullptr;
  std::size_t size = 0;
};

/// A DataArray whose numbers somebody else keeps.
struct DataView {
  int components = 1;
  std::variant<NumberSpan<double>, NumberSpan<float>, NumberSpan<std::int32_t>, NumberSpan<std::uint8_t>> values;
};

template <class Array>
using Named = std::vector<std::pair<std::string, Array>>;

using Texts = std::vector<std::string>;

/// `point_data` has a value a point; `line_data` a value a line.
struct PolyData {
  DataArray points{3, {}};             ///< World; double or single precision.
  bool has_lines = false;              ///< Otherwise each point is a vertex by itself.
  std::vector<std::size_t> line_ends;  ///< For each line, how many points it and those before have.
  Named<DataArray> point_data, line_data;
  Named<Texts> texts;  ///< Field data: notes to the whole.
};

/// PolyData whose numbers somebody else keeps.
struct PolyDataView {
  DataView points{3, {}};
  const std::vector<std::size_t>* line_ends = nullptr;  ///< Null: each point is a vertex by itself.
  Named<DataView> point_data, line_data;
  Named<Texts> texts;
};

DataView view_of(const DataArray& array);
PolyDataView view_of(const PolyData& data);

/// Writes the file in place. @throw std::runtime_error with the reason (not the file): the disk is full.
void write_poly_data(const std::filesystem::path& path, const PolyDataView& data);

/// @throw std::runtime_error with the reason (not the file): not such a file, cut off.
PolyData read_poly_data(const std::filesystem::path& path);

}  // namespace tensorray
