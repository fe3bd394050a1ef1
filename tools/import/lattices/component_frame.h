#pragma once
/// @file tools/import/lattices/component_frame.h
/// The axes that programs of medical images refer the components of vectors and tensors to.

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

enum class ComponentFrame {
  ras,     ///< World axes: right, anterior, superior. MRtrix.
  lps,     ///< Left, posterior, superior. Displacements of ITK and ANTs.
  voxels,  ///< The axes of the voxels. Tensors of ANTs and dipy.
  fsl,     ///< The axes of the voxels, the first one reversed if the image is stored left to right. FSL.
};

/// Those that users can choose, with their names: "ras", "lps", "voxels", "fsl".
const std::vector<std::pair<std::string, ComponentFrame>>& component_frames();

/// From the axes of the components to RAS, an orthogonal matrix: c in RAS = F c.
/// @param to_ras  The linear part of the transform from voxel indices to RAS. If it shears, the axes of the voxels are
/// the rotation (or rotation with a reflection) nearest to their directions.
Eigen::Matrix3d axes_of(ComponentFrame frame, const Eigen::Matrix3d& to_ras);

}  // namespace tensorray
