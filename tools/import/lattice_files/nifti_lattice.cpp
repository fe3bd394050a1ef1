// FSL and MRtrix both write files of six volumes, but with different orders and different axes:
// - MRtrix writes components in world (scanner) axes: https://mrtrix.readthedocs.io, "dwi2tensor".
// - FSL's dtifit takes gradient directions in the image's axes, and flips the first axis if the transform has a
//   positive determinant ("neurological" storage): https://fsl.fmrib.ox.ac.uk, "bvecs". Its components have the
//   same axes.
// Hence FSL's frame is the rotation of the transform, with that flip. The format does not state the axes of symmetric
// matrices by intent code (1005) either. ANTs and dipy write them in the axes of the voxels
// (https://github.com/ANTsX/ANTs/wiki/Warp-and-reorient-a-diffusion-tensor-image), and so they are read. Vectors and
// nine components are read in world axes. --frame says otherwise.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nifti2_io.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "tools/import/lattice_files/lattice_files.h"
#include "tools/import/lattice_files/raw_voxels.h"

namespace tensorray {
namespace {

using Image = std::unique_ptr<nifti_image, decltype(&nifti_image_free)>;

NumberType type_of(int datatype, const std::filesystem::path& path) {
  const char* const name = nifti_datatype_string(datatype);
  return number_type(path, name, name);
}

/// Checks a header, in either byte order, for errors that the library would print.
template <class Header>
void check_header(Header& header, void (*swap)(Header*), const std::filesystem::path& path) {
  if (header.sizeof_hdr != static_cast<int>(sizeof header)) swap(&header);
  bool sound = header.sizeof_hdr == static_cast<int>(sizeof header) && header.dim[0] >= 1 && header.dim[0] <= 7;
  for (int axis = 1; sound && axis <= header.dim[0]; ++axis) sound = header.dim[axis] >= 1;
  if (!sound) fail(path, "its NIfTI header is damaged");
  type_of(header.datatype, path);
}

struct Close {
  void operator()(znzFile file) const { znzclose(file); }
};
using OpenFile = std::unique_ptr<znzptr, Close>;

/// Whether the file begins with the size of a header. NIfTI files with a text header do not; the library would print
/// messages while it reads them.
bool begins_with_size(const std::string& name) {
  const OpenFile file(znzopen(name.c_str(), "rb", nifti_is_gzfile(name.c_str())));
  std::int32_t size = 0;
  if (!file || znzread(&size, 1, sizeof size, file.get()) != sizeof size) return false;
  std::int32_t swapped = size;
  nifti_swap_4bytes(1, &swapped);
  return size == 348 || swapped == 348 || size == 540 || swapped == 540;
}

Image read_header(const std::filesystem::path& path) {
  require_file(path);
  nifti_set_debug_level(0);  // Stop the library from printing.
  const std::string name = path.string();
  if (!begins_with_size(name)) fail(path, "is not a NIfTI file, or cut off in its header");
  int version = 0;
  const std::unique_ptr<void, decltype(&std::free)> raw(nifti_read_header(name.c_str(), &version, 0), &std::free);
  // ANALYZE files have no magic word, no order and no orientation; the library gives them version 0 or 1.
  const auto has_magic = [&](const char* magic, char number) {
    return magic[0] == 'n' && (magic[1] == '+' || magic[1] == 'i') && magic[2] == number && magic[3] == '\0';
  };
  auto* const first = static_cast<nifti_1_header*>(raw.get());
  auto* const second = static_cast<nifti_2_header*>(raw.get());
  if (raw && version == 1 && has_magic(first->magic, '1'))
    check_header(*first, nifti_swap_as_nifti1, path);
  else if (raw && version == 2 && has_magic(second->magic, '2'))
    check_header(*second, nifti_swap_as_nifti2, path);
  else
    fail(path, "is not a NIfTI file, or cut off in its header");
  Image image(nifti_image_read(name.c_str(), 0), &nifti_image_free);
  if (!image || !image->iname) fail(path, "its NIfTI header is damaged, or its .img is missing");
  return image;
}

/// Whether the fourth and the fifth axis are the columns and rows of matrices, as dipy writes arrays (X, Y, Z, 3, 3).
bool has_matrices(const nifti_image& image) {
  return image.dim[0] >= 5 && image.dim[4] == 3 && image.dim[5] == 3 &&
         (image.dim[0] < 6 || image.nu * image.nv * image.nw == image.nu);
}

/// Counts the components along the fourth axis, or along the fifth, which the format prescribes for vectors and
/// matrices, or along both.
int component_count(const nifti_image& image, const std::filesystem::path& path, bool is_mask) {
  if (!is_mask && has_matrices(image)) return 9;
  const auto extent = [&](int axis) { return axis <= image.dim[0] ? image.dim[axis] : 1; };
  const std::int64_t four = extent(4), five = extent(5);
  const std::int64_t count = four > 1 ? four : five;
  if (!is_component_count(static_cast<double>(count), is_mask) || four * five != count || extent(6) != 1 ||
      extent(7) != 1)
    fail(path, fmt::format("its size is {} x {} x {} x {} x {}: {}", extent(1), extent(2), extent(3), four, five,
                           component_words(is_mask)));
  return static_cast<int>(count);
}

/// nifti_image_load is not used, because it replaces numbers that are not finite by zero.
RawVoxels voxels_of(const nifti_image& image, const std::filesystem::path& path, const Lattice& lattice) {
  RawVoxels voxels;
  voxels.type = type_of(image.datatype, path);
  const ByteOrder host = host_byte_order(), other = host == ByteOrder::little ? ByteOrder::big : ByteOrder::little;
  voxels.order = image.byteorder == nifti_short_order() ? host : other;
  voxels.strides = {1, image.nx, image.nx * image.ny, image.nx * image.ny * image.nz};
  // A slope of zero means no scaling; some programs write NaN instead.
  if (std::isfinite(image.scl_slope) && image.scl_slope != 0) {
    voxels.slope = image.scl_slope;
    voxels.intercept = std::isfinite(image.scl_inter) ? image.scl_inter : 0;
  }
  if (image.iname_offset < 0) fail(path, "its NIfTI header is damaged: vox_offset");
  RawPlace place{image.iname, 0, nifti_is_gzfile(image.iname) != 0, 0};
  (place.is_compressed ? place.skipped : place.offset) = static_cast<std::uint64_t>(image.iname_offset);
  voxels.bytes = read_numbers(path, place, voxels.type, lattice.size, lattice.components);
  return voxels;
}

bool has_orientation(const nifti_image& image) { return image.sform_code > 0 || image.qform_code > 0; }

/// From voxel indices to RAS millimetres. Files that do not state their unit are in millimetres. Files without an
/// orientation are taken as FSL, nibabel and SPM take ANALYZE: the first axis runs from right to left.
Eigen::Affine3d to_world(const nifti_image& image, const std::filesystem::path& path) {
  Eigen::Matrix4d matrix = Eigen::Vector4d(-std::abs(image.dx), image.dy, image.dz, 1).asDiagonal();
  if (has_orientation(image)) {
    const nifti_dmat44& form = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
    matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(&form.m[0][0]);
  }
  const double unit = image.xyz_units == NIFTI_UNITS_METER ? 1e3 : image.xyz_units == NIFTI_UNITS_MICRON ? 1e-3 : 1.0;
  Eigen::Affine3d transform;
  transform.matrix() << unit * matrix.topRows<3>(), Eigen::RowVector4d::UnitW();
  const char* const form = image.sform_code > 0 ? "sform" : image.qform_code > 0 ? "qform" : "voxel size";
  require_invertible(path, transform,
                     fmt::format("its {} cannot be inverted: set it (with fslorient, mrtransform or nibabel)", form));
  return transform;
}

/// The header of a pair of files, of which either may be given.
std::filesystem::path header_of(const std::filesystem::path& path) {
  std::string name = path.string();
  for (const std::string ending : {".img", ".img.gz"})
    if (ends_with(lower_case(name), ending)) name.replace(name.size() - ending.size(), 4, ".hdr");
  return name;
}

}  // namespace

Lattice open_nifti(const std::filesystem::path& given, bool is_mask) {
  const std::filesystem::path path = header_of(given);
  const Image image = read_header(path);
  Lattice lattice;
  lattice.components = component_count(*image, path, is_mask);
  for (int axis = 1; axis <= std::min<int>(3, static_cast<int>(image->dim[0])); ++axis)
    if (image->dim[axis] < 1 || image->dim[axis] > std::numeric_limits<int>::max())
      fail(path, "its NIfTI header is damaged: sizes");
  lattice.size = {static_cast<int>(image->nx), static_cast<int>(image->ny), static_cast<int>(image->nz)};
  lattice.to_world = to_world(*image, path);
  lattice.is_anatomical = has_orientation(*image);
  lattice.order_tells_frame = lattice.takes_frame = lattice.zero_is_background = true;
  if (!has_orientation(*image))
    lattice.notes.push_back(
        "states no orientation (the codes of sform and qform are 0): its first axis is taken to run from right to "
        "left, as FSL does; set the sform if it does not");
  RawVoxels voxels = voxels_of(*image, path, lattice);
  voxels.by_columns = has_matrices(*image);
  if (voxels.by_columns) lattice.frame = axes_of(ComponentFrame::voxels, lattice.to_world.linear());
  if (image->intent_code == NIFTI_INTENT_SYMMATRIX && lattice.components == 6)
    lattice.order = TensorOrder::lower_triangle;
  const char* const axes = lattice.order
                               ? "symmetric matrices: taken as those of the voxels, as ANTs and dipy write them"
                           : voxels.by_columns ? "3 x 3 matrices: taken as those of the voxels, as dipy writes them"
                           : lattice.components != 6 ? "components: taken as those of the scanner (RAS)"
                                                     : nullptr;  // Of six, --order tells the axes.
  if (axes) lattice.frame_note = fmt::format("does not say the axes of its {}; --frame says otherwise", axes);
  lattice.read_slice = slices_of(std::move(voxels), lattice.size, lattice.components);
  return lattice;
}

}  // namespace tensorray
