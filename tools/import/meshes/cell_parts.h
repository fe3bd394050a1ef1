#pragma once
/// @file tools/import/meshes/cell_parts.h
/// Divides a cell into small parts, for sums over its volume. Private to the importer.

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "tools/import/meshes/mesh_cell.h"

namespace tensorray {

struct CellPart {
  Eigen::Vector3d position;            ///< The centroid of the part, exactly so where the cell is affine.
  double volume;                       ///< > 0, also of cells that are inside out.
  const std::vector<double>& weights;  ///< Of the cell's points at `position`.
};

/// Calls `visit` for parts of `cell` that cover it and whose edges are at most `longest` along each axis, except for
/// parts that are outside `where`: a part that is thin stays whole along its thin side. The volumes of the parts of an
/// affine cell add up exactly; those of a curved cell as well as the midpoint rule does.
void visit_parts(MeshCell& cell, const Eigen::Vector3d& longest, const Eigen::AlignedBox3d& where,
                 const std::function<void(const CellPart&)>& visit);

}  // namespace tensorray
