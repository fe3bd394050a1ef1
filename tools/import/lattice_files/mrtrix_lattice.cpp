// The format: https://mrtrix.readthedocs.io, "Image file formats". Components are in world (scanner) axes, which are
// RAS.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattice_files/raw_voxels.h"

namespace tensorray {
namespace {

using Path = std::filesystem::path;

[[noreturn]] void fail_header(const Path& path, const std::string& what) {
  fail(path, "its header is damaged: " + what);
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(trimmed(part));
  return parts;
}

bool is_packed(const Path& path) { return ends_with(lower_case(path.string()), ".gz"); }

/// Four extents: of x, y and z, and of the components.
std::vector<std::int64_t> extents_of(const HeaderLines& header, bool is_mask) {
  std::vector<std::int64_t> extents;
  double product = 1;
  for (const double extent : header.numbers("dim")) {
    product *= extent;
    if (!(extent >= 1) || extent != std::floor(extent) || product > 1e15) fail_header(header.path, "dim");
    extents.push_back(static_cast<std::int64_t>(extent));
  }
  if (is_mask && extents.size() == 3) extents.push_back(1);
  if (extents.size() != 4 || !is_component_count(static_cast<double>(extents[3]), is_mask))
    fail(header.path, "its size is " + escaped(header.text("dim")) + ": " + component_words(is_mask));
  return extents;
}

/// Sets the strides and the first number. `layout` has the rank of each axis, from the fastest on, and its sense.
void set_layout(const HeaderLines& header, const std::vector<std::int64_t>& extents, RawVoxels& voxels) {
  std::vector<std::string> parts = split(header.text("layout"));
  if (parts.size() == 3 && extents[3] == 1) parts.emplace_back("+3");
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

void set_type(const HeaderLines& header, RawVoxels& voxels) {
  std::string name = header.text("datatype");
  const std::string ending = name.size() > 2 ? lower_case(name.substr(name.size() - 2)) : "";
  if (ending == "le" || ending == "be") name.resize(name.size() - 2);
  voxels.type = number_type(header.path, name, header.text("datatype"));
  if (ending == "le") voxels.order = ByteOrder::little;
  if (ending == "be") voxels.order = ByteOrder::big;
  const std::vector<double> scaling = header.numbers("scaling", {0, 1});
  if (scaling.size() != 2) fail_header(header.path, "scaling");
  voxels.intercept = scaling[0];
  voxels.slope = scaling[1];
}

RawPlace place_of(const HeaderLines& header) {
  const std::string file = header.text("file");
  if (file.find('\n') != std::string::npos)
    fail(header.path,
         "its numbers are in several files: convert it (mrconvert " + header.path.filename().string() + " one.mif)");
  std::istringstream stream(file);
  std::string name;
  std::uint64_t offset = 0;
  stream >> name >> offset;
  if (name.empty()) fail_header(header.path, "file");
  RawPlace place;
  place.file = name == "." ? header.path : header.path.parent_path() / name;
  place.is_compressed = is_packed(place.file);
  (place.is_compressed ? place.skipped : place.offset) = offset;
  return place;
}

/// Without a transform, the middle of the image is at the origin.
Eigen::Affine3d to_world(const HeaderLines& header, const Eigen::Vector3i& size) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  const std::vector<double> rows = header.numbers("transform");
  if (!rows.empty() && rows.size() != 12 && rows.size() != 16) fail_header(header.path, "transform");
  if (!rows.empty()) transform.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(rows.data());
  const std::vector<double> vox = header.numbers("vox");
  if (vox.size() < 3) fail_header(header.path, "vox");
  transform.linear() *= Eigen::Vector3d(vox.data()).asDiagonal();
  if (rows.empty()) transform.translation() = transform.linear() * (-0.5 * (size.cast<double>().array() - 1)).matrix();
  require_invertible(header.path, transform,
                     "its transform and voxel sizes cannot be inverted: correct them (mrtransform)");
  return transform;
}

}  // namespace

Lattice open_mrtrix(const Path& path, bool is_mask) {
  require_file(path);
  const HeaderLines header = header_lines({path, 0, is_packed(path), 0}, ':', "END");
  if (header.text("file").empty()) fail(path, "is not an image of MRtrix, or cut off in its header");
  const std::vector<std::int64_t> extents = extents_of(header, is_mask);
  for (int axis = 0; axis < 3; ++axis)
    if (extents[static_cast<std::size_t>(axis)] > std::numeric_limits<int>::max()) fail_header(path, "dim");
  Lattice lattice;
  lattice.size = {static_cast<int>(extents[0]), static_cast<int>(extents[1]), static_cast<int>(extents[2])};
  lattice.components = static_cast<int>(extents[3]);
  if (lattice.components == 6) lattice.usual_order = TensorOrder::mrtrix;
  lattice.to_world = to_world(header, lattice.size);
  lattice.is_anatomical = lattice.order_tells_frame = lattice.takes_frame = lattice.zero_is_background = true;
  RawVoxels voxels;
  set_type(header, voxels);
  set_layout(header, extents, voxels);
  voxels.bytes = read_numbers(path, place_of(header), voxels.type, lattice.size, lattice.components);
  lattice.read_slice = slices_of(std::move(voxels), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
