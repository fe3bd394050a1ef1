#pragma once
/// @file volumes/tensors/isosurface.h
/// Surfaces on which an invariant of a tensor field has one value.

#include <vector>

#include <Eigen/Core>

#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

/// Triangles in world space. They are counter-clockwise as seen from the side of smaller values.
struct Isosurface {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3d> normals;  ///< One per vertex, of unit length, towards smaller values.
  std::vector<Eigen::Vector3i> triangles;
};

/// Makes dual contours (OpenVDB's volumeToMesh) of the invariant at the voxels. Inactive voxels count as the zero
/// tensor, whose invariant is 0. Vertices are on the surface to second order in the voxel size. Normals are along
/// the gradient of the invariant, from differences over one voxel to either side. The surface ends on the faces of the
/// field's extent and is open there. It is empty if all voxels are on the same side of `value`. Works with any affine
/// transform. The result does not depend on the number of threads.
/// @throw std::invalid_argument if `value` is not finite in single precision, or if the field has a single voxel along
/// an axis.
Isosurface isosurface(const TensorField& field, Invariant which, double value);

}  // namespace tensorray
