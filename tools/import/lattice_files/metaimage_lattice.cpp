// The format: https://itk.org/Wiki/MetaIO/Documentation. World of ITK's files is left-posterior-superior. The
// components are taken in these axes, as those of ITK's displacements; --frame says otherwise.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattice_files/raw_voxels.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Path = std::filesystem::path;

/// The entries of a header, by their names.
struct Header {
  Path path;
  std::map<std::string, std::string> entries;
  std::uint64_t end = 0;  ///< Offset of what follows the header.

  /// The first of the names, which are synonyms, that is there; empty if none is.
  std::string text(std::initializer_list<const char*> names) const {
    for (const char* name : names)
      if (const auto found = entries.find(name); found != entries.end()) return found->second;
    return {};
  }

  bool is_true(std::initializer_list<const char*> names) const {
    const std::string value = text(names);
    return !value.empty() && (value[0] == 'T' || value[0] == 't' || value[0] == '1');
  }

  /// As many numbers; `standard` if the entry is missing.
  std::vector<double> numbers(std::initializer_list<const char*> names, std::vector<double> standard) const {
    std::istringstream stream(text(names));
    std::vector<double> values;
    for (double value; stream >> value;) values.push_back(value);
    if (text(names).empty()) return standard;
    if (values.size() != standard.size() ||
        !std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); }))
      fail(path, fmt::format("its header is damaged: {} are not {} numbers", *names.begin(), standard.size()));
    return values;
  }
};

/// Lines "NAME = VALUE"; the last one is ElementDataFile.
Header read_header(const Path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) fail(path, "no such file");
  std::ifstream file(path, std::ios::binary);
  Header header{path, {}, 0};
  constexpr int longest = 1 << 16;
  std::vector<char> line(longest);
  for (int lines = 0; lines < 1000 && file.getline(line.data(), longest); ++lines) {
    const std::string text = line.data();
    const std::size_t sign = text.find('=');
    if (sign == std::string::npos && trimmed(text).empty()) continue;
    if (sign == std::string::npos) break;
    const std::string name = trimmed(text.substr(0, sign));
    header.entries[name] = trimmed(text.substr(sign + 1));
    if (name != "ElementDataFile") continue;
    header.end = file.eof() ? std::filesystem::file_size(path) : static_cast<std::uint64_t>(file.tellg());
    return header;
  }
  fail(path, "is not a MetaImage, or cut off in its header: it has no ElementDataFile");
}

NumberType type_of(const Header& header) {
  std::string name = header.text({"ElementType"});
  if (ends_with(name, "_ARRAY")) name.resize(name.size() - 6);
  const std::pair<const char*, const char*> names[] = {
      {"MET_CHAR", "int8"},       {"MET_UCHAR", "uint8"},       {"MET_SHORT", "int16"},   {"MET_USHORT", "uint16"},
      {"MET_INT", "int32"},       {"MET_UINT", "uint32"},       {"MET_LONG", "int32"},    {"MET_ULONG", "uint32"},
      {"MET_LONG_LONG", "int64"}, {"MET_ULONG_LONG", "uint64"}, {"MET_FLOAT", "float32"}, {"MET_DOUBLE", "float64"}};
  for (const auto& [theirs, ours] : names)
    if (name == theirs) return *number_type(ours);
  fail(header.path, "its numbers are of type '" + escaped(name) + "', not integers or reals");
}

RawPlace place_of(const Header& header) {
  const std::string file = header.text({"ElementDataFile"});
  if (header.text({"BinaryData"}) != "" && !header.is_true({"BinaryData"}))
    fail(header.path, "its numbers are text; write it as binary data");
  if (file == "LIST" || file.find('%') != std::string::npos)
    fail(header.path, "its numbers are in several files; write it as one file (.mha)");
  RawPlace place{header.path, header.end, header.is_true({"CompressedData"}), 0};
  if (lower_case(file) == "local") return place;
  place.file = header.path.parent_path() / file;
  place.offset = 0;
  return place;
}

Eigen::Affine3d to_lps(const Header& header) {
  const std::vector<double> axes =
      header.numbers({"TransformMatrix", "Orientation", "Rotation"}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  const std::vector<double> spacing = header.numbers({"ElementSpacing", "ElementSize"}, {1, 1, 1}),
                            origin = header.numbers({"Offset", "Position", "Origin"}, {0, 0, 0});
  Eigen::Affine3d transform;  // The header lists the direction of one axis after the other: the columns.
  transform.linear() = Eigen::Map<const Matrix3d>(axes.data()) * Vector3d(spacing.data()).asDiagonal();
  transform.translation() = Vector3d(origin.data());
  const Matrix3d linear = transform.linear();
  if (!(std::abs(linear.determinant()) > 1e-9 * linear.colwise().norm().prod()))
    fail(header.path, "its TransformMatrix and ElementSpacing cannot be inverted: correct them");
  return transform;
}

Eigen::Vector3i size_of(const Header& header) {
  if (header.text({"NDims"}) != "3")
    fail(header.path, "has " + escaped(header.text({"NDims"})) +
                          " axes (NDims): a field has three, and its components "
                          "are channels");
  const std::vector<double> size = header.numbers({"DimSize"}, {0, 0, 0});
  for (const double extent : size)
    if (!(extent >= 1 && extent <= 1 << 30) || extent != std::floor(extent))
      fail(header.path, "its header is damaged: DimSize");
  return Vector3d(size.data()).cast<int>();
}

}  // namespace

Lattice open_metaimage(const Path& path) {
  const Header header = read_header(path);
  Lattice lattice;
  lattice.size = size_of(header);
  const double channels = header.numbers({"ElementNumberOfChannels"}, {1})[0];
  if (channels != 3 && channels != 6 && channels != 9)
    fail(path, fmt::format("has {} channels: a tensor has six or nine, a vector three", channels));
  lattice.components = static_cast<int>(channels);
  if (lattice.components == 6) lattice.usual_order = TensorOrder::fsl;  // itk::SymmetricSecondRankTensor
  const Eigen::Vector3d signs(-1, -1, 1);
  lattice.to_world = signs.asDiagonal() * to_lps(header);
  lattice.frame = axes_of(ComponentFrame::lps, lattice.to_world.linear());
  lattice.takes_frame = true;
  lattice.zero_is_background = true;

  RawVoxels voxels;
  voxels.type = type_of(header);
  RawPlace place = place_of(header);
  const double skipped = header.numbers({"HeaderSize"}, {0})[0];
  const double bytes = lattice.size.cast<double>().prod() * channels * voxels.type.bytes;
  std::error_code none;  // What is missing is read_numbers' to say.
  const std::uintmax_t size = std::filesystem::file_size(place.file, none);
  if (skipped > 0) place.offset += static_cast<std::uint64_t>(std::min(skipped, 1e15));
  if (skipped < 0 && !place.is_compressed && !none)  // The numbers are at the end of the file.
    place.offset = static_cast<std::uint64_t>(std::max(0.0, static_cast<double>(size) - bytes));
  voxels.order = header.is_true({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) ? ByteOrder::big : ByteOrder::little;
  voxels.bytes = read_numbers(path, place, voxels.type, lattice.size, lattice.components);
  const std::int64_t n = lattice.components, nx = lattice.size.x(), ny = lattice.size.y();
  voxels.strides = {n, n * nx, n * nx * ny, 1};
  lattice.read_slice = slices_of(std::move(voxels), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
