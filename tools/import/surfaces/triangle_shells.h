#pragma once
/// Measures and cuts closed surfaces that are oriented outwards, of several shells that may touch or overlap.

#include <vector>

#include "base/geometry/triangle_mesh.h"

namespace tensorray {

/// The normal of a triangle, as long as its area.
Eigen::Vector3d area_of(const TriangleMesh& shells, std::size_t triangle);

/// For each triangle, whether another shell contains its outer side, a thousandth of its edges from its centroid. Uses
/// all threads.
std::vector<char> inner_triangles(const TriangleMesh& shells);

/// The part that is in a box. Triangles are divided at the planes of the box, and what is beyond is laid flat on the
/// box's faces: so the surface stays closed, and inside the box nothing changes.
TriangleMesh cut_to(TriangleMesh shells, const Eigen::AlignedBox3d& box);

}  // namespace tensorray
