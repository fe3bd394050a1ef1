#include "tools/import/vtk_formats/vtk_counts.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text/short_lines.h"
#include "base/text/text.h"
#include "tools/import/vtk_formats/vtk_tags.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

constexpr double most_expanded = 8000;  // Points for each byte of a file: LZMA makes 7000 bytes of one.
constexpr double most_components = 100000;

std::string impossible(const std::string& what) {
  return "is damaged or cut off: it announces " + what + ", which it cannot hold; copy or write it again";
}

/// The number in `name="number"` of a tag; 0 if there is none.
double number_of(const std::string& tag, const std::string& name) {
  return std::strtod(attribute(tag, name).c_str(), nullptr);
}

/// The points of the extent of a piece; 0 if it has none.
double points_of(const std::string& tag) {
  std::istringstream stream(attribute(tag, "Extent"));
  std::array<double, 6> extent{};
  for (double& bound : extent) stream >> bound;
  double points = stream ? 1 : 0;
  for (std::size_t axis = 0; axis < 3; ++axis) points *= std::max(0.0, extent[2 * axis + 1] - extent[2 * axis] + 1);
  return points;
}

/// The greatest number in a line of a legacy file that announces others; 0 in all other lines.
double announced(const std::string& line) {
  static const std::array<const char*, 17> first{
      "points",  "cells",        "cell_types",    "point_data",    "cell_data",     "vertices",
      "lines",   "polygons",     "field",         "scalars",       "color_scalars", "lookup_table",
      "offsets", "connectivity", "x_coordinates", "y_coordinates", "z_coordinates"};
  static const std::array<const char*, 14> last{"bit",   "unsigned_char", "char",         "unsigned_short", "short",
                                                "int",   "unsigned_int",  "long",         "unsigned_long",  "vtkidtype",
                                                "float", "double",        "vtktypeint64", "string"};
  static const std::array<const char*, 4> named{"field", "scalars", "color_scalars", "lookup_table"};
  std::istringstream stream(lower_case(line));
  std::vector<std::string> words;
  for (std::string word; words.size() < 6 && stream >> word;) words.push_back(word);
  if (words.size() < 2) return 0;
  const bool is_array = words.size() == 4 && std::count(last.begin(), last.end(), words.back()) > 0;
  if (!is_array && std::count(first.begin(), first.end(), words.front()) == 0) return 0;
  const bool is_named = std::count(named.begin(), named.end(), words.front()) > 0;  // The name may be a number.
  double greatest = 0, product = 1;
  for (std::size_t i = is_named ? 2 : 1; i < words.size(); ++i) {
    char* end = nullptr;
    const double number = std::strtod(words[i].c_str(), &end);
    if (*end != '\0') continue;
    greatest = std::max(greatest, number);
    product *= number;
  }
  return is_array ? std::max(greatest, product) : greatest;
}

}  // namespace

std::string impossible_xml_count(const fs::path& path) {
  const double most = most_expanded * static_cast<double>(fs::file_size(path));
  std::string found;
  double points = 0;  // Of the piece whose arrays come; pieces of other files (Source) have theirs there.
  for_each_tag(path, [&](const std::string& tag) {
    if (starts_with(tag, "Piece")) {
      for (const char* count : {"NumberOfPoints", "NumberOfCells", "NumberOfVerts", "NumberOfLines", "NumberOfPolys"})
        if (const double number = number_of(tag, count); !(number <= most))
          found = impossible(fmt::format("{} {:.0f}", count, number));
      points = attribute(tag, "Source").empty() ? points_of(tag) : 0;
    }
    if (!starts_with(tag, "DataArray")) return;
    const double components = number_of(tag, "NumberOfComponents");
    if (!(components >= 0 && components <= std::min(most, most_components)))
      found = impossible(fmt::format("{:.0f} components of an array", components));
    if (points > most) found = impossible(fmt::format("{:.0f} points", points));
  });
  return found;
}

std::string impossible_legacy_count(const fs::path& path) {
  constexpr int first_line = 3;  // After the version, and a title of any words.
  const double most = 8 * static_cast<double>(fs::file_size(path));
  std::string found;
  int number = 0;
  for_each_short_line(path, 254, [&](const std::string& line) {
    if (++number >= first_line && !(announced(line) <= most)) found = impossible("\"" + escaped(line) + "\"");
    return found.empty();
  });
  return found;
}

}  // namespace tensorray
