#include "tools/import/surfaces/body_surface.h"

#include <set>
#include <utility>
#include <vector>

#include <vtkCellData.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>

#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/surfaces/face_triangles.h"
#include "tools/import/surfaces/triangle_shells.h"

namespace tensorray {
namespace {

using Tensor = Eigen::Map<const Eigen::Matrix<double, 9, 1>>;

/// Chooses the faces of cells that have finite tensors, as far as there are any.
ChooseFaces with_data(vtkDataSet& mesh) {
  const double* const of_points = made_tensors(*mesh.GetPointData());
  const double* const of_cells = made_tensors(*mesh.GetCellData());
  return [=](const MeshCell& cell, vtkIdType id, std::vector<CellFace>& faces) {
    bool is_finite = !of_cells || Tensor(of_cells + 9 * id).allFinite();
    for (int i = 0; of_points && i < cell.points(); ++i)
      is_finite = is_finite && Tensor(of_points + 9 * cell.point(i)).allFinite();
    if (!is_finite) faces.clear();
  };
}

}  // namespace

BodyFaces body_faces(vtkDataSet& mesh) {
  BodyFaces body{points_of(mesh), {}, 0};
  body.faces = outer_faces(mesh, body.points, with_data(mesh));
  body.inner = remove_crossed_faces(body.faces, body.points);
  return body;
}

BodySurface body_surface(vtkDataSet& mesh, const BodyFaces& faces, double tolerance) {
  BodySurface surface;
  FaceTriangles triangles = triangles_of(mesh, faces.points, faces.faces, tolerance);
  surface.mesh = std::move(triangles.mesh);
  const std::vector<char> inner = inner_triangles(surface.mesh);
  std::set<std::size_t> inner_faces;
  for (std::size_t i = 0; i < inner.size(); ++i)
    if (inner[i])
      inner_faces.insert(triangles.face_of[i]);
    else
      surface.area += area_of(surface.mesh, i).norm();
  surface.inner_faces = faces.inner + inner_faces.size();
  surface.open_edges = open_edges(surface.mesh);
  return surface;
}

}  // namespace tensorray
