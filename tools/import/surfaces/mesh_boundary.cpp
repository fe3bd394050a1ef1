#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/constants.h"
#include "tools/import/surfaces/body_surface.h"
#include "tools/import/surfaces/face_triangles.h"

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
  std::set<Eigen::Index> farthest;
  constexpr int directions = 4000;
  const double golden_angle = pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < directions; ++i) {
    const double z = 1 - (2 * i + 1.0) / directions, radius = std::sqrt(1 - z * z);
    const Vector3d direction(radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i), z);
    Eigen::Index point = 0;
    (direction.transpose() * cloud).maxCoeff(&point);
    farthest.insert(point);
  }
  Eigen::Matrix3Xd extreme(3, static_cast<Eigen::Index>(farthest.size()));
  next = 0;
  for (const Eigen::Index point : farthest) extreme.col(next++) = cloud.col(point);
  return extreme;
}

TriangleMesh surrounded_surface(vtkDataSet& mesh) {
  const MeshPoints points = points_of(mesh);
  std::vector<CellFace> faces =
      outer_faces(mesh, points, [](const MeshCell&, vtkIdType, const std::vector<CellFace>&) {});
  remove_crossed_faces(faces, points);
  if (faces.empty()) throw std::invalid_argument("the mesh has no three-dimensional cells: it lies around no body");
  const Eigen::Matrix3Xd extreme = extreme_points(faces, points);
  const double diagonal = (extreme.rowwise().maxCoeff() - extreme.rowwise().minCoeff()).norm();
  const auto is_convex = [&](const CellFace& face) {
    const Eigen::Matrix3Xd corners = corners_of(face, points);
    const Vector3d inwards = -face_measure(corners).area.normalized();
    const double depth = (inwards.transpose() * corners).minCoeff() - (inwards.transpose() * extreme).minCoeff();
    return !(depth > 1e-3 * diagonal);
  };
  faces.erase(std::remove_if(faces.begin(), faces.end(), is_convex), faces.end());
  TriangleMesh surface = triangles_of(mesh, points, std::move(faces), 1e-4 * diagonal).mesh;
  for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  return surface;
}

}  // namespace

std::size_t write_boundary(vtkDataSet& mesh, const std::filesystem::path& path) {
  const TriangleMesh surface = surrounded_surface(mesh);
  if (!surface.triangles.empty()) write_ply(path, surface, PlyPositions::double_precision);
  return surface.triangles.size();
}

}  // namespace tensorray
