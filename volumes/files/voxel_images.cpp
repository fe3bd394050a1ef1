#include "volumes/files/voxel_images.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <sstream>

#include <zlib.h>

#include "base/errors.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

template <class Number>
void put(std::string& bytes, std::size_t offset, Number value) {
  std::memcpy(&bytes[offset], &value, sizeof value);
}

/// Numbers with a blank between them, exact.
template <class Vector>
std::string numbers(const Vector& vector, const char* between = " ") {
  std::ostringstream text;
  text.precision(17);
  for (Eigen::Index i = 0; i < vector.size(); ++i) text << (i > 0 ? between : "") << vector[i];
  return text.str();
}

std::string nifti_header(const VoxelImage& image) {
  std::string header(352, '\0');
  const bool is_list = image.names.size() > 1;
  const auto& M = image.to_world.matrix();
  const Vector3d edges = image.to_world.linear().colwise().norm();
  put<std::int32_t>(header, 0, 348);
  const std::int16_t extents[] = {static_cast<std::int16_t>(is_list ? 4 : 3),
                                  static_cast<std::int16_t>(image.size.x()),
                                  static_cast<std::int16_t>(image.size.y()),
                                  static_cast<std::int16_t>(image.size.z()),
                                  static_cast<std::int16_t>(image.names.size()),
                                  1,
                                  1,
                                  1};
  std::memcpy(&header[40], extents, sizeof extents);
  put<std::int16_t>(header, 70, 16);  // float32
  put<std::int16_t>(header, 72, 32);
  put(header, 76, 1.0f);
  for (int axis = 0; axis < 3; ++axis) put(header, 80 + 4 * std::size_t(axis), static_cast<float>(edges[axis]));
  put(header, 108, 352.0f);
  put(header, 112, 1.0f);
  put<std::uint8_t>(header, 123, 2);  // millimetres
  put<std::int16_t>(header, 254, 2);  // the sform, aligned to another image
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      put(header, 280 + 16 * std::size_t(row) + 4 * std::size_t(column), static_cast<float>(M(row, column)));
  std::memcpy(&header[344], "n+1", 4);
  return header;
}

std::string nrrd_header(const VoxelImage& image) {
  const bool is_list = image.names.size() > 1;
  std::string directions;
  for (int axis = 0; axis < 3; ++axis)
    directions += " (" + numbers(Vector3d(image.to_world.linear().col(axis)), ",") + ")";
  return "NRRD0004\ntype: float\ndimension: " + std::string(is_list ? "4" : "3") +
         "\nspace: right-anterior-superior\nsizes: " + numbers(image.size) +
         (is_list ? " " + std::to_string(image.names.size()) : "") + "\nspace directions:" + directions +
         (is_list ? " none" : "") + "\nkinds: domain domain domain" + (is_list ? " list" : "") +
         "\nendian: little\nencoding: raw\nspace origin: (" + numbers(Vector3d(image.to_world.translation()), ",") +
         ")\n# " + joined(image.names) + "\n\n";
}

std::string mif_header(const VoxelImage& image) {
  const bool is_list = image.names.size() > 1;
  const Vector3d edges = image.to_world.linear().colwise().norm();
  std::string header = "mrtrix image\ndim: " + numbers(image.size, ",") +
                       (is_list ? "," + std::to_string(image.names.size()) : "") + "\nvox: " + numbers(edges, ",") +
                       (is_list ? ",1" : "") + "\nlayout: +0,+1,+2" + (is_list ? ",+3" : "") +
                       "\ndatatype: Float32LE\n";
  for (int row = 0; row < 3; ++row)
    header +=
        "transform: " + numbers(Vector3d(image.to_world.linear().row(row).transpose().cwiseQuotient(edges)), ",") +
        "," + numbers(Eigen::Matrix<double, 1, 1>(image.to_world.translation()[row])) + "\n";
  header += "comments: " + joined(image.names) + "\n";
  const std::size_t offset = (header.size() + 40 + 15) / 16 * 16;
  header += "file: . " + std::to_string(offset) + "\nEND\n";
  header.resize(offset, '\0');
  return header;
}

std::string vti_header(const VoxelImage& image, std::size_t bytes) {
  const Vector3d edges = image.to_world.linear().colwise().norm();
  const Eigen::Matrix3d axes = image.to_world.linear() * edges.cwiseInverse().asDiagonal();
  const std::string extent = "0 " + std::to_string(image.size.x() - 1) + " 0 " + std::to_string(image.size.y() - 1) +
                             " 0 " + std::to_string(image.size.z() - 1);
  std::string header =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<ImageData WholeExtent=\"" +
      extent + "\" Origin=\"" + numbers(Vector3d(image.to_world.translation())) + "\" Spacing=\"" + numbers(edges) +
      "\" Direction=\"" + numbers(axes.transpose().reshaped()) + "\">\n<Piece Extent=\"" + extent +
      "\">\n<PointData>\n";
  for (std::size_t i = 0; i < image.names.size(); ++i)
    header += "<DataArray type=\"Float32\" Name=\"" + image.names[i] + "\" format=\"appended\" offset=\"" +
              std::to_string(i * (bytes + 8)) + "\"/>\n";
  return header + "</PointData>\n</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_";
}

}  // namespace

const std::vector<std::string>& voxel_image_endings() {
  static const std::vector<std::string> endings{".nii", ".nii.gz", ".nrrd", ".mif", ".vti"};
  return endings;
}

VoxelImage voxel_image(const std::vector<ScalarGrid>& grids, const Vector3i& voxels) {
  Eigen::AlignedBox3i box;
  for (const ScalarGrid& grid : grids)
    box.extend(active_box(std::vector<BlockShape>(grid.blocks.begin(), grid.blocks.end())));
  if (const Eigen::AlignedBox3i all(Vector3i::Zero(), Vector3i(voxels - Vector3i::Ones()));
      voxels.minCoeff() > 0 && all.contains(box))
    box = all;
  VoxelImage image;
  image.size = box.sizes() + Vector3i::Ones();
  image.to_world = grids.front().to_world * Eigen::Translation3d(box.min().cast<double>());
  const std::size_t volume = image.size.cast<std::size_t>().prod();
  image.values.assign(volume * grids.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < grids.size(); ++i) {
    image.names.push_back(grids[i].name);
    for (const ScalarBlock& block : grids[i].blocks)
      for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
        const auto at = static_cast<std::size_t>(offset);
        if (!block.active[at]) continue;
        const Eigen::Matrix<std::size_t, 3, 1> p =
            (block.origin + TensorBlock::position(offset) - box.min()).cast<std::size_t>();
        const Eigen::Matrix<std::size_t, 3, 1> size = image.size.cast<std::size_t>();
        image.values[i * volume + (p.z() * size.y() + p.y()) * size.x() + p.x()] = block.values[at];
      }
  }
  return image;
}

void write_voxel_image(const std::filesystem::path& file, const VoxelImage& image) {
  const std::string ending = lower_case_ending(file);
  const bool is_nifti = ending == ".nii" || ending == ".gz";
  const std::size_t bytes = image.values.size() / image.names.size() * sizeof(float);
  if (is_nifti && image.size.maxCoeff() > std::numeric_limits<std::int16_t>::max())
    fail(file, "NIfTI has at most 32767 voxels along an axis; write .nrrd");
  const gzFile stream = gzopen(file.c_str(), ending == ".gz" ? "wb" : "wbT");  // T: as it is, not compressed.
  bool is_written = stream != nullptr;
  const auto write = [&](const char* data, std::size_t size) {
    constexpr std::size_t most = 1 << 30;  // Of bytes at once, for zlib.
    for (; is_written && size > 0; data += std::min(size, most), size -= std::min(size, most))
      is_written = gzwrite(stream, data, static_cast<unsigned>(std::min(size, most))) > 0;
  };
  const std::string header = is_nifti            ? nifti_header(image)
                             : ending == ".nrrd" ? nrrd_header(image)
                             : ending == ".mif"  ? mif_header(image)
                                                 : vti_header(image, bytes);
  write(header.data(), header.size());
  for (std::size_t i = 0; i < image.names.size(); ++i) {
    const std::uint64_t size = bytes;
    if (ending == ".vti") write(reinterpret_cast<const char*>(&size), sizeof size);
    write(reinterpret_cast<const char*>(image.values.data()) + i * bytes, bytes);
  }
  const std::string end = "\n</AppendedData>\n</VTKFile>\n";
  if (ending == ".vti") write(end.data(), end.size());
  if (!stream || gzclose(stream) != Z_OK || !is_written) fail(file, "cannot be written: the disk may be full");
}

}  // namespace tensorray
