#include "tools/import/surfaces/mesh_boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
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

/// For each of many directions, the point of the faces that is farthest in that direction. For any plane, these
/// include a point that is nearly the farthest in front of it: the error is at most 1 − cos of half the directions'
/// spacing (4e-4 of the diagonal). All results are points of the mesh.
Eigen::Matrix3Xd extreme_points(vtkDataSet& mesh, const std::vector<CellFace>& faces, const MeshPoints& points) {
  std::vector<Vector3d> candidates;
  std::vector<bool> seen(points.positions.size(), false);
  MeshCell cell;
  for (const CellFace& face : faces) {
    cell.load(mesh, face.cell);
    vtkIdList& ids = *cell.vtk().GetFace(face.index)->GetPointIds();
    for (vtkIdType i = 0; i < ids.GetNumberOfIds(); ++i) {
      const auto id = static_cast<std::size_t>(points.representative(ids.GetId(i)));
      if (!seen[id]) candidates.push_back(points.positions[id]);
      seen[id] = true;
    }
  }
  constexpr int directions = 4000;
  const double golden_angle = pi * (3 - std::sqrt(5.0));
  const Eigen::Map<const Eigen::Matrix3Xd> cloud(candidates.front().data(), 3,
                                                 static_cast<Eigen::Index>(candidates.size()));
  std::vector<Eigen::Index> farthest;
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - (2 * i + 1.0) / directions, radius = std::sqrt(1 - z * z);
    const Vector3d direction(radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z);
    Eigen::Index point = 0;
    (direction.transpose() * cloud).maxCoeff(&point);
    farthest.push_back(point);
  }
  std::sort(farthest.begin(), farthest.end());
  farthest.erase(std::unique(farthest.begin(), farthest.end()), farthest.end());
  Eigen::Matrix3Xd extreme(3, static_cast<Eigen::Index>(farthest.size()));
  for (std::size_t i = 0; i < farthest.size(); ++i) extreme.col(static_cast<Eigen::Index>(i)) = cloud.col(farthest[i]);
  return extreme;
}

/// A face as triangles of point indices, counter-clockwise as seen from inside the cell; no triangles if it has no
/// area.
struct FacePlane {
  std::vector<std::array<vtkIdType, 3>> triangles;
  Vector3d normal = Vector3d::Zero();  ///< Unit length; points into the cell.
  double outmost = 0;  ///< Position along the normal of the face's own point that is farthest out of the cell.
};

FacePlane plane_of(const MeshCell& cell, int index, const MeshPoints& points) {
  FacePlane plane;
  Vector3d centre = Vector3d::Zero();
  vtkNew<vtkIdList> ids;
  vtkNew<vtkPoints> unused;
  cell.vtk().GetFace(index)->Triangulate(0, ids, unused);
  for (vtkIdType i = 0; i + 2 < ids->GetNumberOfIds(); i += 3) {
    std::array<vtkIdType, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) triangle[k] = points.representative(ids->GetId(i + static_cast<vtkIdType>(k)));
    const Vector3d a = points[triangle[0]], b = points[triangle[1]], c = points[triangle[2]];
    const Vector3d area = (b - a).cross(c - a);
    if (area.isZero(0)) continue;
    plane.triangles.push_back(triangle);
    plane.normal += area;
    centre += (a + b + c) / 3;
  }
  if (plane.triangles.empty()) return plane;
  centre /= static_cast<double>(plane.triangles.size());
  plane.normal.normalize();
  if (plane.normal.dot(cell.positions().rowwise().mean() - centre) < 0) {
    plane.normal = -plane.normal;
    for (auto& triangle : plane.triangles) std::swap(triangle[1], triangle[2]);
  }
  plane.outmost = plane.normal.dot(centre);
  for (const auto& triangle : plane.triangles)
    for (const vtkIdType id : triangle) plane.outmost = std::min(plane.outmost, plane.normal.dot(points[id]));
  return plane;
}

TriangleMesh surrounded_surface(vtkDataSet& mesh) {
  const MeshPoints points = points_of(mesh);
  // VTK lists no faces of convex point sets.
  const std::vector<CellFace> faces =
      outer_faces(mesh, points, [](const MeshCell& cell, vtkIdType, std::vector<CellFace>& of_cell) {
        if (cell.vtk().GetCellType() == VTK_CONVEX_POINT_SET) of_cell.clear();
      });
  if (faces.empty()) throw std::invalid_argument("the mesh has no three-dimensional cells: it lies around no body");
  const Eigen::Matrix3Xd extreme = extreme_points(mesh, faces, points);
  const double min_depth = 1e-3 * (extreme.rowwise().maxCoeff() - extreme.rowwise().minCoeff()).norm();
  TriangleMesh surface;
  std::map<vtkIdType, std::uint32_t> vertex_of_point;
  MeshCell cell;
  for (const CellFace& face : faces) {
    cell.load(mesh, face.cell);
    const FacePlane plane = plane_of(cell, face.index, points);
    const double depth = plane.outmost - (plane.normal.transpose() * extreme).minCoeff();
    if (!(depth > min_depth)) continue;
    for (const auto& triangle : plane.triangles) {
      std::array<std::uint32_t, 3> vertices{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [vertex, is_new] =
            vertex_of_point.try_emplace(triangle[k], static_cast<std::uint32_t>(surface.vertices.size()));
        if (is_new) surface.vertices.push_back(points[triangle[k]]);
        vertices[k] = vertex->second;
      }
      surface.triangles.push_back(vertices);
    }
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
