// Files are read one at a time, because Teem keeps its errors in one list for the whole process.

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <teem/biff.h>
#include <teem/nrrd.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattice_files/raw_voxels.h"

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Free {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
  void operator()(char* text) const { std::free(text); }
};
using NrrdPointer = std::unique_ptr<Nrrd, Free>;

struct Axes {
  unsigned int component = 0;
  std::array<unsigned int, 3> space{};
};

struct Components {
  bool masked = false;
  std::optional<TensorOrder> order;
};

/// The innermost of Teem's errors, which gives the reason, without the name of the function.
std::string last_error() {
  const std::unique_ptr<char, Free> text(biffGetDone(NRRD));
  std::string lines = text ? text.get() : "";
  lines.erase(lines.find_last_not_of(" \n") + 1);
  const std::string line = lines.substr(lines.find_last_of('\n') + 1);
  const std::size_t colon = line.find(": ");
  return colon == std::string::npos ? line : line.substr(colon + 2);
}

/// Refuses files that Teem would read as another kind (text, pictures), standard input, and patterns of file names,
/// which Teem passes to printf.
void check_header(const std::filesystem::path& path) {
  require_file(path);
  std::ifstream file(path, std::ios::binary);
  std::string line(1 << 16, '\0');
  file.getline(line.data(), static_cast<std::streamsize>(line.size()));
  if (line.compare(0, 7, "NRRD000") != 0) fail(path, "is not a NRRD file");
  std::string data_file;
  while (file.getline(line.data(), static_cast<std::streamsize>(line.size())) && line[0] != '\0' && line[0] != '\r') {
    const std::string text = line.c_str();
    for (const std::string field : {"data file: ", "datafile: "})  // Teem ignores case.
      if (starts_with(lower_case(text), field)) data_file = trimmed(text.substr(field.size()));
  }
  if (file.fail() && !file.eof()) fail(path, "its header is damaged: a line is too long");
  if (data_file.find('%') != std::string::npos || data_file.compare(0, 4, "LIST") == 0 ||
      data_file.compare(0, 8, "SKIPLIST") == 0)
    fail(path, "its numbers are in several files: join them (unu save -f nrrd -i " + path.filename().string() + ")");
  if (data_file == "-") fail(path, "its data file is standard input");
  std::error_code none;
  if (!data_file.empty() && !std::filesystem::is_regular_file(path.parent_path() / data_file, none))
    fail(path, "its data file " + escaped(data_file) + " is missing, or no file; copy it there too");
}

NrrdPointer read_nrrd(const std::filesystem::path& path) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  nrrdStateVerboseIO = 0;  // Stop Teem from printing.
  check_header(path);
  NrrdPointer nrrd(nrrdNew());
  if (nrrdLoad(nrrd.get(), std::filesystem::absolute(path).string().c_str(), nullptr) != 0)
    fail(path, "damaged or cut off: " + last_error());
  if (nrrd->type == nrrdTypeBlock) fail(path, "its type is block, not numbers");
  for (unsigned int axis = 0; axis < nrrd->dim; ++axis)
    if (nrrd->axis[axis].size > static_cast<std::size_t>(std::numeric_limits<int>::max()))
      fail(path, "its header is damaged: sizes");
  return nrrd;
}

bool is_space(const Nrrd& nrrd, unsigned int axis) {
  if (nrrd.spaceDim > 0) return std::isfinite(nrrd.axis[axis].spaceDirection[0]);
  const int kind = nrrd.axis[axis].kind;
  return kind == nrrdKindSpace || kind == nrrdKindDomain;
}

/// The component axis is the one that is not spatial; if the file does not tell, it is the first axis. A mask may have
/// none.
Axes find_axes(const Nrrd& nrrd, const std::filesystem::path& path, bool is_mask) {
  if (is_mask && nrrd.dim == 3 && (nrrd.spaceDim == 0 || nrrd.spaceDim == 3)) return {3, {0, 1, 2}};
  if (nrrd.dim != 4 || (nrrd.spaceDim != 0 && nrrd.spaceDim != 3))
    fail(path,
         fmt::format("has {} axes in {} dimensions of space: {}", nrrd.dim, nrrd.spaceDim,
                     is_mask ? component_words(true) : "a field of tensors has three axes and one of components"));
  std::vector<unsigned int> components, space;
  for (unsigned int axis = 0; axis < 4; ++axis) (is_space(nrrd, axis) ? space : components).push_back(axis);
  if (components.size() == 4 && nrrd.spaceDim == 0) return {0, {1, 2, 3}};
  if (components.size() != 1)
    fail(path, fmt::format("{} of its four axes are of space, which should be three", space.size()));
  return {components[0], {space[0], space[1], space[2]}};
}

Components find_components(const NrrdAxisInfo& axis, const std::filesystem::path& path, bool is_mask) {
  if (is_mask && axis.size > 1) fail(path, fmt::format("has {} components: {}", axis.size, component_words(true)));
  if (is_mask) return {};
  const std::pair<int, Components> kinds[] = {{nrrdKind3DSymMatrix, {false, TensorOrder::fsl}},
                                              {nrrdKind3DMaskedSymMatrix, {true, TensorOrder::fsl}},
                                              {nrrdKind3DMatrix, {false, TensorOrder::full}},
                                              {nrrdKind3DMaskedMatrix, {true, TensorOrder::full}}};
  for (const auto& [kind, components] : kinds)
    if (axis.kind == kind) return components;
  if (axis.size == 3 || axis.size == 6) return {};
  if (axis.size == 7) return {true, TensorOrder::fsl};  // Teem itself reads seven components this way.
  if (axis.size == 9) return {false, TensorOrder::full};
  fail(path, fmt::format("has {} components: a tensor has six, seven with a mask, or nine; a vector three", axis.size));
}

/// The signs that take the file's space to RAS.
Vector3d to_ras(const Nrrd& nrrd) {
  const bool is_lps = nrrd.space == nrrdSpaceLeftPosteriorSuperior,
             is_las = nrrd.space == nrrdSpaceLeftAnteriorSuperior;
  return {is_lps || is_las ? -1.0 : 1.0, is_lps ? -1.0 : 1.0, 1.0};
}

/// For an axis without a direction: the voxel spacing, and the position of the first voxel.
std::pair<double, double> spacing_and_start(const NrrdAxisInfo& axis) {
  const double spacing = std::isfinite(axis.spacing) ? axis.spacing : 1;
  if (!std::isfinite(axis.min)) return {spacing, 0};
  return {spacing, axis.center == nrrdCenterCell ? axis.min + 0.5 * spacing : axis.min};
}

/// The space origin is the centre of the first voxel, whatever the file's centering is.
Eigen::Affine3d to_world(const Nrrd& nrrd, const Axes& axes, const std::filesystem::path& path) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  for (int i = 0; i < 3; ++i) {
    const NrrdAxisInfo& axis = nrrd.axis[axes.space[static_cast<std::size_t>(i)]];
    if (nrrd.spaceDim == 3)
      transform.linear().col(i) = Eigen::Map<const Vector3d>(axis.spaceDirection);
    else
      std::tie(transform.linear()(i, i), transform.translation()(i)) = spacing_and_start(axis);
  }
  if (nrrd.spaceDim == 3 && std::isfinite(nrrd.spaceOrigin[0]))
    transform.translation() = Eigen::Map<const Vector3d>(nrrd.spaceOrigin);
  require_invertible(
      path, transform,
      "its space directions (or spacings) and origin are no transform that can be inverted: correct them");
  return to_ras(nrrd).asDiagonal() * transform;
}

bool has_frame(const Nrrd& nrrd) { return nrrd.spaceDim == 3 && !std::isnan(nrrd.measurementFrame[0][0]); }

bool is_anatomical(const Nrrd& nrrd) {
  return nrrd.space == nrrdSpaceRightAnteriorSuperior || nrrd.space == nrrdSpaceLeftPosteriorSuperior ||
         nrrd.space == nrrdSpaceLeftAnteriorSuperior;
}

/// From the measurement frame, which the components use, to RAS. The file lists the columns of the matrix:
/// measurementFrame[i] is column i.
Matrix3d frame_of(const Nrrd& nrrd, const std::filesystem::path& path) {
  Matrix3d frame = Matrix3d::Identity();
  if (has_frame(nrrd))
    for (int i = 0; i < 3; ++i) frame.col(i) = Eigen::Map<const Vector3d>(nrrd.measurementFrame[i]);
  require_invertible(path, Eigen::Affine3d(frame), "its measurement frame cannot be inverted: correct or remove it");
  return to_ras(nrrd).asDiagonal() * frame;
}

RawVoxels voxels_of(NrrdPointer nrrd, const Axes& axes, const std::filesystem::path& path) {
  std::array<std::int64_t, 4> strides{};  // Of the axes of the file.
  std::int64_t stride = 1;
  for (std::size_t axis = 0; axis < 4; ++axis) {
    strides[axis] = stride;
    stride *= static_cast<std::int64_t>(nrrd->axis[axis].size);
  }
  const char* const kind = !nrrdTypeIsIntegral[nrrd->type] ? "float" : nrrdTypeIsUnsigned[nrrd->type] ? "uint" : "int";
  const std::string type = fmt::format("{}{}", kind, 8 * nrrdElementSize(nrrd.get()));
  RawVoxels voxels;
  voxels.type = number_type(path, type, type);
  voxels.strides = {strides[axes.space[0]], strides[axes.space[1]], strides[axes.space[2]], strides[axes.component]};
  const std::shared_ptr<Nrrd> owner = std::move(nrrd);
  voxels.bytes = {owner, static_cast<const char*>(owner->data)};
  return voxels;
}

}  // namespace

Lattice open_nrrd(const std::filesystem::path& path, bool is_mask) {
  NrrdPointer nrrd = read_nrrd(path);
  const Axes axes = find_axes(*nrrd, path, is_mask);
  const Components components = find_components(nrrd->axis[axes.component], path, is_mask);
  Lattice lattice;
  for (int i = 0; i < 3; ++i)
    lattice.size[i] = static_cast<int>(nrrd->axis[axes.space[static_cast<std::size_t>(i)]].size);
  lattice.components = is_mask ? 1 : static_cast<int>(nrrd->axis[axes.component].size);
  lattice.masked = components.masked;
  lattice.order = components.order;
  lattice.to_world = to_world(*nrrd, axes, path);
  lattice.frame = frame_of(*nrrd, path);
  const char* const unit = nrrd->spaceUnits[0];
  lattice.is_anatomical = is_anatomical(*nrrd) && (!unit || std::string(unit) == "mm");
  lattice.takes_frame = is_anatomical(*nrrd) && !has_frame(*nrrd);
  if (lattice.takes_frame)
    lattice.frame_note =
        "has no measurement frame: the axes of its components are taken as those of its space; --frame says otherwise";
  lattice.zero_is_background = true;
  lattice.read_slice = slices_of(voxels_of(std::move(nrrd), axes, path), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
