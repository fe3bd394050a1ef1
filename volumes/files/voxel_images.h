#pragma once
/// Numbers at the voxels of a box, as files that programs of medical images and ParaView show.

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "volumes/grids/tensor_grid.h"

namespace tensorray {

struct VoxelImage {
  Eigen::Vector3i size = Eigen::Vector3i::Ones();
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();  ///< From voxel indices (0 ...); world is RAS.
  std::vector<std::string> names;                          ///< Of the volumes.
  std::vector<float> values;                               ///< x fastest, volume after volume.
};

/// ".nii", ".nii.gz", ".nrrd", ".mif", ".vti".
const std::vector<std::string>& voxel_image_endings();

/// Grids of one field as the volumes of an image, NaN where they have no voxel. @param voxels  The image's, from index
/// 0 on; zero: the box of the active ones.
VoxelImage voxel_image(const std::vector<ScalarGrid>& grids, const Eigen::Vector3i& voxels);

/// Writes float32 in the format of the ending: NIfTI-1 (as .gz, compressed), NRRD, MRtrix, VTK's ImageData. Several
/// volumes are along a fourth axis, or arrays. @throw std::runtime_error naming the file.
void write_voxel_image(const std::filesystem::path& file, const VoxelImage& image);

}  // namespace tensorray
