#pragma once
/// @file volumes/points/poly_data.h
/// Points or polylines with named values, and the file in which `tensorray-import` hands polylines to this program.
/// Users never see this file: its numbers have the machine's byte order, and both programs must have the same
/// version.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace tensorray {

/// Values of `components` numbers each, one value after another, in the number type of the file.
struct DataArray {
  int components = 1;
  std::variant<std::vector<double>, std::vector<float>, std::vector<std::int32_t>, std::vector<std::uint8_t>> values;
};

template <class Number>
struct NumberSpan {
  const Number* data = nullptr;
  std::size_t size = 0;
};

/// A DataArray that refers to numbers that the caller owns.
struct DataView {
  int components = 1;
  std::variant<NumberSpan<double>, NumberSpan<float>, NumberSpan<std::int32_t>, NumberSpan<std::uint8_t>> values;
};

template <class Array>
using Named = std::vector<std::pair<std::string, Array>>;

using Texts = std::vector<std::string>;

/// Points or polylines, whose numbers the caller owns: one value per point or per line.
struct PolyDataView {
  DataView points{3, {}};                               ///< World positions; double or single precision.
  const std::vector<std::size_t>* line_ends = nullptr;  ///< Null: each point is a vertex by itself.
  Named<DataView> point_data, line_data;
  Named<Texts> texts;  ///< Field data: notes about the whole.
};

DataView view_of(const DataArray& array);

/// Polylines, all of whose numbers are doubles.
struct PolyLines {
  struct Values {
    int components = 1;
    std::vector<double> numbers;
  };
  Values points{3, {}};
  std::vector<std::size_t> line_ends;  ///< For each line: the number of points up to its end, earlier lines included.
  Named<Values> point_data, line_data;
};

/// Writes the file in place. @throw std::runtime_error with the reason (without the file) when the disk is full.
void write_poly_lines(const std::filesystem::path& path, PolyLines lines);

/// @throw std::runtime_error with the reason (without the file) if the file is of another kind or is cut off.
PolyLines read_poly_lines(const std::filesystem::path& path);

}  // namespace tensorray
