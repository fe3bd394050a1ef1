#pragma once
/// Divides a cell into small parts, for sums over its volume.

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "tools/import/meshes/mesh_cell.h"

namespace tensorray {

/// A parallelepiped, except where the cell is curved or tapers.
struct CellPart {
  Eigen::Vector3d position;  ///< Its centroid, exactly so where the cell is affine.
  double volume;             ///< > 0, also of cells that are inside out.
  Eigen::Matrix3d edges;     ///< As columns.
  /// Of the cell's points, as columns: the weight at `position`, and its changes along the edges. Valid until the next
  /// part.
  const Eigen::Matrix4Xd& weights;
};

/// Calls `visit` for parts of `cell` that cover it and whose edges are at most `longest` along each axis, except for
/// parts that are outside `where`: a part that is thin stays whole along its thin side. Parts of cells that taper or
/// are curved are half as long. The volumes of the parts of an affine cell add up exactly; those of a curved cell as
/// well as the midpoint rule does.
void visit_parts(MeshCell& cell, const Eigen::Vector3d& longest, const Eigen::AlignedBox3d& where,
                 const std::function<void(const CellPart&)>& visit);

}  // namespace tensorray
