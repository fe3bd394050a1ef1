// Teem reads the header first; then the sizes are checked; then Teem reads the data. Files are read one at a time,
// because Teem keeps its errors in one list for the whole process.

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
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

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Free {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
  void operator()(char* text) const { std::free(text); }
};
using NrrdPointer = std::unique_ptr<Nrrd, Free>;
using StatePointer = std::unique_ptr<NrrdIoState, Free>;

/// The role of each axis of the file.
struct Axes {
  unsigned int component = 0;
  std::array<unsigned int, 3> space{};
};

/// The meaning of the components.
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
/// which Teem passes to printf. @return the header's entry for the data file; empty if the data are in the file
/// itself.
std::string check_header(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) fail(path, "no such file");
  std::ifstream file(path, std::ios::binary);
  std::string line(1 << 16, '\0');
  file.getline(line.data(), static_cast<std::streamsize>(line.size()));
  if (line.compare(0, 7, "NRRD000") != 0) fail(path, "is not a NRRD file");
  std::string data_file;
  while (file.getline(line.data(), static_cast<std::streamsize>(line.size())) && line[0] != '\0' && line[0] != '\r') {
    const std::string text = line.c_str();
    std::string lower = text;  // Teem ignores case.
    std::transform(text.begin(), text.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
    for (const std::string field : {"data file: ", "datafile: "})
      if (lower.compare(0, field.size(), field) == 0) data_file = text.substr(field.size());
  }
  if (file.fail() && !file.eof()) fail(path, "its header is damaged: a line is too long");
  data_file.erase(0, data_file.find_first_not_of(" \t"));
  data_file.erase(data_file.find_last_not_of(" \t\r") + 1);
  if (data_file.find('%') != std::string::npos || data_file.compare(0, 4, "LIST") == 0 ||
      data_file.compare(0, 8, "SKIPLIST") == 0)
    fail(path, "its numbers are in several files: join them (unu save -f nrrd -i " + path.filename().string() + ")");
  if (data_file == "-") fail(path, "its data file is standard input");
  if (!data_file.empty() && !std::filesystem::is_regular_file(path.parent_path() / data_file, none))
    fail(path, "its data file " + escaped(data_file) + " is missing, or no file; copy it there too");
  return data_file;
}

/// @return the name of the encoding.
std::string load(const std::filesystem::path& path, Nrrd& nrrd, bool header_only) {
  const StatePointer state(nrrdIoStateNew());
  nrrdIoStateSet(state.get(), nrrdIoStateSkipData, header_only ? 1 : 0);
  if (nrrdLoad(&nrrd, std::filesystem::absolute(path).string().c_str(), state.get()) != 0)
    fail(path, "damaged or cut off: " + last_error());
  return state->encoding->name;
}

/// The greatest number of data bytes that `bytes` of a file can encode. zlib expands one byte to at most 1032, bzip2
/// to about 20000. As hex text, a byte takes two characters; as ASCII text, a number takes at least one digit and a
/// space.
double greatest_content(const std::string& encoding, double bytes, double element_size) {
  if (encoding == "gzip") return 1032 * bytes;
  if (encoding == "bzip2") return 20000 * bytes;
  if (encoding == "hex") return bytes / 2;
  if (encoding == "ASCII") return element_size * (bytes + 1) / 2;
  return bytes;
}

/// Checks the sizes before memory is allocated.
void check_sizes(const std::filesystem::path& path, const Nrrd& nrrd, const std::string& data_file,
                 const std::string& encoding) {
  const std::filesystem::path data = data_file.empty() ? path : path.parent_path() / data_file;
  std::error_code none;
  const std::uintmax_t bytes = std::filesystem::file_size(data, none);
  if (none) fail(path, "its data cannot be read: " + none.message());
  double needed = static_cast<double>(nrrdElementSize(&nrrd));
  for (unsigned int axis = 0; axis < nrrd.dim; ++axis) {
    needed *= static_cast<double>(nrrd.axis[axis].size);
    if (nrrd.axis[axis].size > static_cast<std::size_t>(std::numeric_limits<int>::max()))
      fail(path, "its header is damaged: sizes");
  }
  const auto element = static_cast<double>(nrrdElementSize(&nrrd));
  if (needed > greatest_content(encoding, static_cast<double>(bytes), element))
    fail(path, fmt::format("announces {:.0f} bytes of numbers, and holds no more than {} ({}): cut off, or a damaged "
                           "header",
                           needed, bytes, encoding));
}

NrrdPointer read_nrrd(const std::filesystem::path& path) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  nrrdStateVerboseIO = 0;  // Stop Teem from printing.
  const std::string data_file = check_header(path);
  NrrdPointer nrrd(nrrdNew());
  const std::string encoding = load(path, *nrrd, true);
  if (nrrd->type == nrrdTypeBlock) fail(path, "its type is block, not numbers");
  check_sizes(path, *nrrd, data_file, encoding);
  load(path, *nrrd, false);
  return nrrd;
}

bool is_space(const Nrrd& nrrd, unsigned int axis) {
  if (nrrd.spaceDim > 0) return std::isfinite(nrrd.axis[axis].spaceDirection[0]);
  const int kind = nrrd.axis[axis].kind;
  return kind == nrrdKindSpace || kind == nrrdKindDomain;
}

/// The component axis is the one that is not spatial; if the file does not tell, it is the first axis.
Axes find_axes(const Nrrd& nrrd, const std::filesystem::path& path) {
  if (nrrd.dim != 4 || (nrrd.spaceDim != 0 && nrrd.spaceDim != 3))
    fail(path, fmt::format("has {} axes in {} dimensions of space: a field of tensors has three axes and one of "
                           "components",
                           nrrd.dim, nrrd.spaceDim));
  std::vector<unsigned int> components, space;
  for (unsigned int axis = 0; axis < 4; ++axis) (is_space(nrrd, axis) ? space : components).push_back(axis);
  if (components.size() == 4 && nrrd.spaceDim == 0) return {0, {1, 2, 3}};
  if (components.size() != 1)
    fail(path, fmt::format("{} of its four axes are of space, which should be three", space.size()));
  return {components[0], {space[0], space[1], space[2]}};
}

Components find_components(const Nrrd& nrrd, unsigned int axis, const std::filesystem::path& path) {
  switch (nrrd.axis[axis].kind) {
    case nrrdKind3DSymMatrix:
      return {false, TensorOrder::fsl};
    case nrrdKind3DMaskedSymMatrix:
      return {true, TensorOrder::fsl};
    case nrrdKind3DMatrix:
      return {false, TensorOrder::full};
    case nrrdKind3DMaskedMatrix:
      return {true, TensorOrder::full};
    default:
      break;
  }
  switch (nrrd.axis[axis].size) {
    case 3:
    case 6:
      return {false, std::nullopt};
    case 7:
      return {true, TensorOrder::fsl};  // Teem itself reads seven components this way.
    case 9:
      return {false, TensorOrder::full};
    default:
      fail(path, fmt::format("has {} components: a tensor has six, seven with a mask, or nine; a vector three",
                             nrrd.axis[axis].size));
  }
}

/// The signs that take the file's space to RAS.
Vector3d to_ras(const Nrrd& nrrd) {
  switch (nrrd.space) {
    case nrrdSpaceLeftPosteriorSuperior:
      return {-1, -1, 1};
    case nrrdSpaceLeftAnteriorSuperior:
      return {-1, 1, 1};
    default:
      return {1, 1, 1};
  }
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
  const Matrix3d& linear = transform.linear();
  if (!transform.matrix().allFinite() || !(std::abs(linear.determinant()) > 1e-9 * linear.colwise().norm().prod()))
    fail(path, "its space directions (or spacings) and origin are no transform that can be inverted: correct them");
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
  if (!frame.allFinite() || !(std::abs(frame.determinant()) > 1e-9 * frame.colwise().norm().prod()))
    fail(path, "its measurement frame cannot be inverted: correct or remove it");
  return to_ras(nrrd).asDiagonal() * frame;
}

/// Reads slices from Teem's array, and frees its memory slice by slice if each slice is contiguous.
class Slices {
 public:
  Slices(NrrdPointer nrrd, const Axes& axes) : nrrd_(std::move(nrrd)), component_(axes.component), space_(axes.space) {
    std::size_t stride = 1;
    for (unsigned int axis = 0; axis < 4; ++axis) {
      stride_[axis] = stride;
      stride *= nrrd_->axis[axis].size;
    }
  }

  void read(int z, double* values) {
    const auto lookup = nrrdDLookup[nrrd_->type];
    const std::size_t first = static_cast<std::size_t>(z) * stride_[space_[2]];
    for (std::size_t y = 0; y < nrrd_->axis[space_[1]].size; ++y)
      for (std::size_t x = 0; x < nrrd_->axis[space_[0]].size; ++x)
        for (std::size_t c = 0; c < nrrd_->axis[component_].size; ++c)
          *values++ =
              lookup(nrrd_->data, first + y * stride_[space_[1]] + x * stride_[space_[0]] + c * stride_[component_]);
    if (space_[2] == 3 && first > 0)
      if (void* less = std::realloc(nrrd_->data, first * nrrdElementSize(nrrd_.get()))) nrrd_->data = less;
  }

 private:
  NrrdPointer nrrd_;
  unsigned int component_;
  std::array<unsigned int, 3> space_;
  std::array<std::size_t, 4> stride_{};  ///< Stride of each axis of the file, counted in numbers.
};

}  // namespace

Lattice open_nrrd(const std::filesystem::path& path) {
  NrrdPointer nrrd = read_nrrd(path);
  const Axes axes = find_axes(*nrrd, path);
  const Components components = find_components(*nrrd, axes.component, path);
  Lattice lattice;
  for (int i = 0; i < 3; ++i)
    lattice.size[i] = static_cast<int>(nrrd->axis[axes.space[static_cast<std::size_t>(i)]].size);
  lattice.components = static_cast<int>(nrrd->axis[axes.component].size);
  lattice.masked = components.masked;
  lattice.order = components.order;
  lattice.to_world = to_world(*nrrd, axes, path);
  lattice.frame = frame_of(*nrrd, path);
  lattice.takes_frame = is_anatomical(*nrrd) && !has_frame(*nrrd);
  lattice.zero_is_background = true;
  const auto slices = std::make_shared<Slices>(std::move(nrrd), axes);
  lattice.read_slice = [slices](int z, double* values) { slices->read(z, values); };
  return lattice;
}

}  // namespace tensorray
