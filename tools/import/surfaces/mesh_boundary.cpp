#include "tools/import/surfaces/mesh_boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <vtkDataSet.h>
#include <vtkIdList.h>
#include <vtkPoints.h>

#include "base/constants.h"
#include "base/geometry/ply_writer.h"
#include "base/geometry/triangle_mesh.h"
#include "tools/import/meshes/mesh_cell.h"
#include "tools/import/meshes/mesh_faces.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// For each of many directions, the corner of the faces that is farthest in that direction. For any plane, these
/// include a corner that is nearly the farthest in front of it: the error is at most 1 − cos of half the directions'
/// spacing (4e-4 of the diagonal).
Eigen::Matrix3Xd extreme_points(const std::vector<CellFace>& faces, const MeshPoints& points) {
  std::set<vtkIdType> corners;
  for (const CellFace& face : faces) corners.insert(face.corners.begin(), face.corners.end());
  Eigen::Matrix3Xd cloud(3, static_cast<Eigen::Index>(corners.size()));
  Eigen::Index next = 0;
  for (const vtkIdType corner : corners) cloud.col(next++) = points[corner];
  constexpr int directions = 4000;
  const double golden_angle = pi * (3 - std::sqrt(5.0));
  Eigen::Matrix3Xd extreme(3, directions);
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - (2 * i + 1.0) / directions, radius = std::sqrt(1 - z * z);
    const Vector3d direction(radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z);
    Eigen::Index point = 0;
    (direction.transpose() * cloud).maxCoeff(&point);
    extreme.col(i) = cloud.col(point);
  }
  return extreme;
}

/// The vertices of a surface, by the points of the mesh.
using Vertices = std::map<vtkIdType, std::uint32_t>;

/// Adds VTK's triangles of a face, such that they look into its cell.
void add_face(vtkCell& face, const Vector3d& inwards, const MeshPoints& points, Vertices& vertices,
              TriangleMesh& surface) {
  vtkNew<vtkIdList> ids;
  vtkNew<vtkPoints> unused;
  face.Triangulate(0, ids, unused);
  for (vtkIdType i = 0; i + 2 < ids->GetNumberOfIds(); i += 3) {
    std::array<std::uint32_t, 3> triangle{};
    std::array<Vector3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const vtkIdType id = points.representative(ids->GetId(i + static_cast<vtkIdType>(k)));
      p[k] = points[id];
      const auto [vertex, is_new] = vertices.try_emplace(id, static_cast<std::uint32_t>(surface.vertices.size()));
      if (is_new) surface.vertices.push_back(p[k]);
      triangle[k] = vertex->second;
    }
    const Vector3d area = (p[1] - p[0]).cross(p[2] - p[0]);
    if (area.dot(inwards) < 0) std::swap(triangle[1], triangle[2]);
    if (!area.isZero(0)) surface.triangles.push_back(triangle);
  }
}

TriangleMesh surrounded_surface(vtkDataSet& mesh) {
  const MeshPoints points = points_of(mesh);
  // VTK lists no faces of convex point sets.
  const std::vector<CellFace> faces =
      outer_faces(mesh, points, [](const MeshCell& cell, vtkIdType, std::vector<CellFace>& of_cell) {
        if (cell.vtk().GetCellType() == VTK_CONVEX_POINT_SET) of_cell.clear();
      });
  if (faces.empty()) throw std::invalid_argument("the mesh has no three-dimensional cells: it lies around no body");
  const Eigen::Matrix3Xd extreme = extreme_points(faces, points);
  const double min_depth = 1e-3 * (extreme.rowwise().maxCoeff() - extreme.rowwise().minCoeff()).norm();
  TriangleMesh surface;
  Vertices vertices;
  MeshCell cell;
  for (const CellFace& face : faces) {
    const Eigen::Matrix3Xd corners = corners_of(face, points);
    const Vector3d inwards = -face_measure(corners).area.normalized();
    const double depth = (inwards.transpose() * corners).minCoeff() - (inwards.transpose() * extreme).minCoeff();
    if (!(depth > min_depth)) continue;
    cell.load(mesh, face.cell);
    add_face(*cell.vtk().GetFace(face.index), inwards, points, vertices, surface);
  }
  return surface;
}

}  // namespace

std::size_t write_boundary(vtkDataSet& mesh, const std::filesystem::path& path) {
  const TriangleMesh surface = surrounded_surface(mesh);
  if (!surface.triangles.empty()) write_ply(path, surface, PlyPositions::double_precision);
  return surface.triangles.size();
}

}  // namespace tensorray
