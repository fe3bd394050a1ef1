#pragma once
/// Surfaces on which an invariant of a tensor field has one value.

#include <vector>

#include <Eigen/Core>

#include "base/geometry/triangle_mesh.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {

/// Triangles that are counter-clockwise as seen from the side of smaller values.
struct Isosurface {
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> normals;  ///< One a vertex, unit, towards smaller values.
};

/// Dual contours (OpenVDB's volumeToMesh) of the invariant at the voxels of level 0; inactive voxels have that of the
/// zero tensor, which is 0. Vertices lie on the surface to second order in the voxels' size; normals are the
/// invariant's gradient, over a voxel to either side. The surface is open where it meets the faces of the field's
/// extent, and ends on them. It is empty where no voxel is on the other side of `value`. In any affine transform; the
/// same on any number of threads.
/// @throw std::invalid_argument if `value` is not finite in single precision, or if the field has a single voxel along
/// an axis.
Isosurface isosurface(const TensorField& field, Invariant which, double value);

}  // namespace tensorray
