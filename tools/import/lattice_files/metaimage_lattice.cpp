// The format: https://itk.org/Wiki/MetaIO/Documentation. World of ITK's files is left-posterior-superior. The
// components are taken in these axes, as those of ITK's displacements; --frame says otherwise.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattice_files/raw_voxels.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

bool is_true(const HeaderLines& header, std::initializer_list<const char*> synonyms) {
  return std::any_of(synonyms.begin(), synonyms.end(), [&](const char* name) {
    const std::string value = header.text(name);
    return !value.empty() && std::string("Tt1").find(value[0]) != std::string::npos;
  });
}

/// As many finite numbers; `standard` if none of the synonyms is there.
std::vector<double> numbers_of(const HeaderLines& header, std::initializer_list<const char*> synonyms,
                               const std::vector<double>& standard) {
  for (const char* name : synonyms) {
    if (header.text(name).empty()) continue;
    const std::vector<double> numbers = header.numbers(name);
    if (numbers.size() != standard.size() ||
        !std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); }))
      fail(header.path, fmt::format("its header is damaged: {} are not {} numbers", name, standard.size()));
    return numbers;
  }
  return standard;
}

NumberType type_of(const HeaderLines& header) {
  std::string name = header.text("ElementType");
  if (ends_with(name, "_ARRAY")) name.resize(name.size() - 6);
  const std::pair<const char*, const char*> names[] = {
      {"MET_CHAR", "int8"},       {"MET_UCHAR", "uint8"},       {"MET_SHORT", "int16"},   {"MET_USHORT", "uint16"},
      {"MET_INT", "int32"},       {"MET_UINT", "uint32"},       {"MET_LONG", "int32"},    {"MET_ULONG", "uint32"},
      {"MET_LONG_LONG", "int64"}, {"MET_ULONG_LONG", "uint64"}, {"MET_FLOAT", "float32"}, {"MET_DOUBLE", "float64"}};
  for (const auto& [theirs, ours] : names)
    if (name == theirs) return number_type(header.path, ours, theirs);
  fail(header.path, "its numbers are of type '" + escaped(name) + "', not integers or reals");
}

/// @param bytes  That the numbers take.
RawPlace place_of(const HeaderLines& header, double bytes) {
  const std::string file = header.text("ElementDataFile");
  if (!header.text("BinaryData").empty() && !is_true(header, {"BinaryData"}))
    fail(header.path, "its numbers are text; write it as binary data");
  if (file == "LIST" || file.find('%') != std::string::npos)
    fail(header.path, "its numbers are in several files; write it as one file (.mha)");
  RawPlace place{header.path, header.end, is_true(header, {"CompressedData"}), 0};
  if (lower_case(file) != "local") place = {header.path.parent_path() / file, 0, place.is_compressed, 0};
  const double skipped = numbers_of(header, {"HeaderSize"}, {0})[0];
  std::error_code none;  // What is missing is read_numbers' to say.
  const std::uintmax_t size = std::filesystem::file_size(place.file, none);
  if (skipped > 0) place.offset += static_cast<std::uint64_t>(std::min(skipped, 1e15));
  if (skipped < 0 && !place.is_compressed && !none)  // The numbers are at the end of the file.
    place.offset = static_cast<std::uint64_t>(std::max(0.0, static_cast<double>(size) - bytes));
  return place;
}

Eigen::Affine3d to_lps(const HeaderLines& header) {
  const std::vector<double> axes =
      numbers_of(header, {"TransformMatrix", "Orientation", "Rotation"}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  Eigen::Affine3d transform;  // The header lists the direction of one axis after the other: the columns.
  transform.linear() = Eigen::Map<const Eigen::Matrix3d>(axes.data()) *
                       Vector3d(numbers_of(header, {"ElementSpacing", "ElementSize"}, {1, 1, 1}).data()).asDiagonal();
  transform.translation() = Vector3d(numbers_of(header, {"Offset", "Position", "Origin"}, {0, 0, 0}).data());
  require_invertible(header.path, transform, "its TransformMatrix and ElementSpacing cannot be inverted: correct them");
  return transform;
}

Eigen::Vector3i size_of(const HeaderLines& header) {
  if (header.text("NDims") != "3")
    fail(header.path,
         "has " + escaped(header.text("NDims")) + " axes (NDims): a field has three, and its components are channels");
  const std::vector<double> size = numbers_of(header, {"DimSize"}, {0, 0, 0});
  for (const double extent : size)
    if (!(extent >= 1 && extent <= 1 << 30) || extent != std::floor(extent))
      fail(header.path, "its header is damaged: DimSize");
  return Vector3d(size.data()).cast<int>();
}

}  // namespace

Lattice open_metaimage(const std::filesystem::path& path, bool is_mask) {
  require_file(path);
  const HeaderLines header = header_lines({path, 0, false, 0}, '=', "ElementDataFile");
  if (header.text("ElementDataFile").empty())
    fail(path, "is not a MetaImage, or cut off in its header: it has no ElementDataFile");
  Lattice lattice;
  lattice.size = size_of(header);
  const double channels = numbers_of(header, {"ElementNumberOfChannels"}, {1})[0];
  if (!is_component_count(channels, is_mask))
    fail(path, fmt::format("has {} channels: {}", channels, component_words(is_mask)));
  lattice.components = static_cast<int>(channels);
  if (lattice.components == 6) lattice.usual_order = TensorOrder::fsl;  // itk::SymmetricSecondRankTensor
  lattice.to_world = Vector3d(-1, -1, 1).asDiagonal() * to_lps(header);
  lattice.frame = axes_of(ComponentFrame::lps, lattice.to_world.linear());
  lattice.is_anatomical = lattice.takes_frame = lattice.zero_is_background = true;
  lattice.frame_note = "does not say the axes of its components: taken as ITK's (LPS); --frame says otherwise";

  RawVoxels voxels;
  voxels.type = type_of(header);
  voxels.order =
      is_true(header, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) ? ByteOrder::big : ByteOrder::little;
  const RawPlace place = place_of(header, lattice.size.cast<double>().prod() * channels * voxels.type.bytes);
  voxels.bytes = read_numbers(path, place, voxels.type, lattice.size, lattice.components);
  const std::int64_t n = lattice.components, nx = lattice.size.x(), ny = lattice.size.y();
  voxels.strides = {n, n * nx, n * nx * ny, 1};
  lattice.read_slice = slices_of(std::move(voxels), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
