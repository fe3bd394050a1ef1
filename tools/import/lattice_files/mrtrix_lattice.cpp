// The format: https://mrtrix.readthedocs.io, "Image file formats". Components are in world (scanner) axes, which are
// RAS.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
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

using Path = std::filesystem::path;

/// The lines "NAME: VALUE" of a header. Lines of one name follow each other in `transform` alone.
struct Header {
  Path path;
  std::string dim, vox, layout, datatype, scaling, file;
  std::vector<std::string> transform;
};

[[noreturn]] void fail_header(const Path& path, const std::string& what) {
  fail(path, "its header is damaged: " + what);
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(trimmed(part));
  return parts;
}

std::vector<double> numbers_in(const Header& header, const std::string& text, const char* name) {
  std::vector<double> numbers;
  for (const std::string& part : split(text)) {
    char* end = nullptr;
    numbers.push_back(std::strtod(part.c_str(), &end));
    if (part.empty() || *end != '\0') fail_header(header.path, name);
  }
  return numbers;
}

void read_line(Header& header, const std::string& line) {
  const std::size_t colon = line.find(':');
  if (colon == std::string::npos) return;
  const std::string name = lower_case(line.substr(0, colon));
  const std::string value = trimmed(line.substr(colon + 1));
  for (const auto& [field, text] : {std::pair("dim", &header.dim),
                                    {"vox", &header.vox},
                                    {"layout", &header.layout},
                                    {"datatype", &header.datatype},
                                    {"scaling", &header.scaling}})
    if (name == field) *text = value;
  if (name == "transform") header.transform.push_back(value);
  if (name != "file") return;
  if (!header.file.empty())
    fail(header.path,
         "its numbers are in several files: convert it (mrconvert " + header.path.filename().string() + " one.mif)");
  header.file = value;
}

Header read_header(const Path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) fail(path, "no such file");
  constexpr std::size_t longest = 1 << 22;  // of a header, which may list all gradients
  const auto bytes = read_some({path, 0, ends_with(lower_case(path.string()), ".gz"), 0}, longest);
  std::istringstream stream(std::string(bytes.begin(), bytes.end()));
  Header header{path, {}, {}, {}, {}, {}, {}, {}};
  std::string line;
  if (!std::getline(stream, line) || line.compare(0, 12, "mrtrix image") != 0) fail(path, "is not an image of MRtrix");
  while (std::getline(stream, line)) {
    if (line == "END" || line == "END\r") return header;
    read_line(header, line);
  }
  if (header.file.empty()) fail(path, "is cut off in its header");
  return header;  // A .mih has no END.
}

/// Four extents: of x, y and z, and of the components.
std::vector<std::int64_t> extents_of(const Header& header) {
  std::vector<std::int64_t> extents;
  double product = 1;
  for (const double extent : numbers_in(header, header.dim, "dim")) {
    product *= extent;
    if (!(extent >= 1) || extent != std::floor(extent) || product > 1e15) fail_header(header.path, "dim");
    extents.push_back(static_cast<std::int64_t>(extent));
  }
  if (extents.size() != 4 || (extents[3] != 3 && extents[3] != 6 && extents[3] != 9))
    fail(header.path, "its size is " + escaped(header.dim) +
                          ": a tensor has four axes, the last one of six or nine "
                          "volumes, a vector three");
  return extents;
}

/// Sets the strides and the first number. `layout` has the rank of each axis, from the fastest on, and its sense.
void set_layout(const Header& header, const std::vector<std::int64_t>& extents, RawVoxels& voxels) {
  const std::vector<std::string> parts = split(header.layout);
  std::vector<int> axis_of_rank(4, -1);
  for (std::size_t axis = 0; axis < parts.size(); ++axis) {
    const double rank = std::abs(std::atof(parts[axis].c_str()));
    if (parts[axis].find_first_of("0123456789") == std::string::npos || rank > 3) fail_header(header.path, "layout");
    axis_of_rank[static_cast<std::size_t>(rank)] = static_cast<int>(axis);
  }
  if (parts.size() != 4 || std::count(axis_of_rank.begin(), axis_of_rank.end(), -1) > 0)
    fail_header(header.path, "layout");
  std::int64_t stride = 1;
  for (const int i : axis_of_rank) {
    const auto axis = static_cast<std::size_t>(i);
    const bool is_reversed = parts[axis][0] == '-';
    voxels.strides[axis] = is_reversed ? -stride : stride;
    if (is_reversed) voxels.first += (extents[axis] - 1) * stride;
    stride *= extents[axis];
  }
}

void set_type(const Header& header, RawVoxels& voxels) {
  std::string name = header.datatype;
  const std::string ending = name.size() > 2 ? lower_case(name.substr(name.size() - 2)) : "";
  if (ending == "le" || ending == "be") name.resize(name.size() - 2);
  const std::optional<NumberType> type = number_type(name);
  if (!type) fail(header.path, "its numbers are " + escaped(header.datatype) + ", not integers or reals");
  voxels.type = *type;
  if (ending == "le") voxels.order = ByteOrder::little;
  if (ending == "be") voxels.order = ByteOrder::big;
  if (header.scaling.empty()) return;
  const std::vector<double> scaling = numbers_in(header, header.scaling, "scaling");
  if (scaling.size() != 2) fail_header(header.path, "scaling");
  voxels.intercept = scaling[0];
  voxels.slope = scaling[1];
}

RawPlace place_of(const Header& header) {
  std::istringstream stream(header.file);
  std::string name;
  std::uint64_t offset = 0;
  stream >> name >> offset;
  if (name.empty()) fail_header(header.path, "file");
  RawPlace place{header.path, 0, ends_with(lower_case(header.path.string()), ".gz"), 0};
  if (name != ".") place = {header.path.parent_path() / name, 0, ends_with(lower_case(name), ".gz"), 0};
  (place.is_compressed ? place.skipped : place.offset) = offset;
  return place;
}

/// Without a transform, the middle of the image is at the origin.
Eigen::Affine3d to_world(const Header& header, const Eigen::Vector3i& size) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (!header.transform.empty() && header.transform.size() != 3 && header.transform.size() != 4)
    fail_header(header.path, "transform");
  for (std::size_t row = 0; row < std::min<std::size_t>(3, header.transform.size()); ++row) {
    const std::vector<double> values = numbers_in(header, header.transform[row], "transform");
    if (values.size() != 4) fail_header(header.path, "transform");
    matrix.row(static_cast<int>(row)) = Eigen::Map<const Eigen::RowVector4d>(values.data());
  }
  const std::vector<double> vox = numbers_in(header, header.vox, "vox");
  if (vox.size() < 3) fail_header(header.path, "vox");
  Eigen::Affine3d transform(matrix);
  transform.linear() *= Eigen::Vector3d(vox.data()).asDiagonal();
  if (header.transform.empty())
    transform.translation() = transform.linear() * (-0.5 * (size.cast<double>().array() - 1)).matrix();
  const Eigen::Matrix3d linear = transform.linear();
  if (!transform.matrix().allFinite() || !(std::abs(linear.determinant()) > 1e-9 * linear.colwise().norm().prod()))
    fail(header.path, "its transform and voxel sizes cannot be inverted: correct them (mrtransform)");
  return transform;
}

}  // namespace

Lattice open_mrtrix(const Path& path) {
  const Header header = read_header(path);
  const std::vector<std::int64_t> extents = extents_of(header);
  for (int axis = 0; axis < 3; ++axis)
    if (extents[static_cast<std::size_t>(axis)] > std::numeric_limits<int>::max()) fail_header(path, "dim");
  Lattice lattice;
  lattice.size = {static_cast<int>(extents[0]), static_cast<int>(extents[1]), static_cast<int>(extents[2])};
  lattice.components = static_cast<int>(extents[3]);
  if (lattice.components == 6) lattice.usual_order = TensorOrder::mrtrix;
  lattice.to_world = to_world(header, lattice.size);
  lattice.fsl_frame = axes_of(ComponentFrame::fsl, lattice.to_world.linear());
  lattice.lower_frame = axes_of(ComponentFrame::voxels, lattice.to_world.linear());
  lattice.takes_frame = true;
  lattice.zero_is_background = true;
  RawVoxels voxels;
  set_type(header, voxels);
  set_layout(header, extents, voxels);
  voxels.bytes = read_numbers(path, place_of(header), voxels.type, lattice.size, lattice.components);
  lattice.read_slice = slices_of(std::move(voxels), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
