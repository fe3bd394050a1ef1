#pragma once
/// A cell of each three-dimensional type that VTK has, with a known volume.

#include <vtkCell.h>
#include <vtkCellTypes.h>
#include <vtkGenericCell.h>
#include <vtkIdList.h>

#include "tests/import/mesh_fixtures.h"

namespace tensorray {

struct CellKind {
  int type = 0;
  int order = 1;  ///< Of Lagrange and Bézier cells.
};

inline std::string name_of(const CellKind& kind) {
  return vtkCellTypes::GetClassNameFromTypeId(kind.type) + std::string("_") + std::to_string(kind.order);
}

inline bool is_higher_order(int type) { return type >= VTK_LAGRANGE_CURVE && type <= VTK_BEZIER_PYRAMID; }

/// All types that have three dimensions, except for Bézier wedges, which are refused; of Lagrange and Bézier cells, the
/// orders 1 to 4.
inline std::vector<CellKind> solid_cell_kinds() {
  std::vector<CellKind> kinds;
  for (int type = 0; type < VTK_NUMBER_OF_CELL_TYPES; ++type) {
    const auto cell = vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(type));
    if (!cell || cell->GetCellDimension() != 3 || type == VTK_BEZIER_WEDGE) continue;
    for (int order = 1; order <= (is_higher_order(type) ? 4 : 1); ++order) kinds.push_back({type, order});
  }
  return kinds;
}

inline int points_of(const CellKind& kind) {
  const int n = kind.order;
  if (kind.type == VTK_LAGRANGE_TETRAHEDRON || kind.type == VTK_BEZIER_TETRAHEDRON)
    return (n + 1) * (n + 2) * (n + 3) / 6;
  if (kind.type == VTK_LAGRANGE_HEXAHEDRON || kind.type == VTK_BEZIER_HEXAHEDRON) return (n + 1) * (n + 1) * (n + 1);
  if (kind.type == VTK_LAGRANGE_WEDGE) return (n + 1) * (n + 1) * (n + 2) / 2;
  const auto cell = vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(kind.type));
  return static_cast<int>(cell->GetNumberOfPoints());
}

/// The points of a cell where VTK has them in parametric space.
inline std::vector<Vector3d> parametric_points(const CellKind& kind) {
  if (kind.type == VTK_CONVEX_POINT_SET || kind.type == VTK_POLYHEDRON) return mesh_fixtures::cube_corners();
  // Only a cell of a grid knows its order.
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  vtkNew<vtkIdList> ids;
  for (int i = 0; i < points_of(kind); ++i) ids->InsertNextId(points->InsertNextPoint(0, 0, 0));
  grid->SetPoints(points);
  grid->InsertNextCell(kind.type, ids);
  vtkCell* const cell = grid->GetCell(0);
  const double* const at = cell->GetParametricCoords();
  std::vector<Vector3d> result;
  for (int i = 0; i < cell->GetNumberOfPoints(); ++i) result.emplace_back(at + 3 * i);
  if (kind.type == VTK_QUADRATIC_PYRAMID)  // Its parametric space is a cube whose top is one point.
    for (std::size_t i = 0; i < 4; ++i) result[9 + i] = 0.5 * (result[i] + result[4]);
  return result;
}

inline double parametric_volume(const CellKind& kind) {
  const std::string name = name_of(kind);
  const auto is_a = [&](const char* shape) { return name.find(shape) != std::string::npos; };
  if (is_a("Tetra")) return 1.0 / 6;
  if (is_a("Wedge")) return 1.0 / 2;
  if (is_a("TriQuadraticPyramid")) return 1.0 / 6;  // VTK has its base at a height of 1/2.
  if (is_a("Pyramid")) return 1.0 / 3;
  if (!is_a("Prism")) return 1;
  const std::vector<Vector3d> points = parametric_points(kind);
  double area = 0;  // Of the polygon of the first half of the points.
  for (std::size_t i = 0, n = points.size() / 2; i < n; ++i)
    area += 0.5 * (points[i].x() * points[(i + 1) % n].y() - points[i].y() * points[(i + 1) % n].x());
  return std::abs(area);
}

/// A grid of one cell of this kind, whose parametric space `map` moves to the world.
inline vtkSmartPointer<vtkUnstructuredGrid> one_cell(const CellKind& kind, const Affine3d& map) {
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->InsertNextPoint(Vector3d(map.translation()).data());  // Of no cell, so that no index is that in the cell.
  vtkNew<vtkIdList> ids;
  for (const Vector3d& p : parametric_points(kind))
    ids->InsertNextId(points->InsertNextPoint(Vector3d(map * p).data()));
  grid->SetPoints(points);
  if (kind.type == VTK_POLYHEDRON) {
    vtkNew<vtkIdList> faces;
    for (const vtkIdType id :
         {6, 4, 1, 4, 3, 2, 4, 5, 6, 7, 8, 4, 1, 2, 6, 5, 4, 2, 3, 7, 6, 4, 3, 4, 8, 7, 4, 4, 1, 5, 8})
      faces->InsertNextId(id);
    grid->InsertNextCell(kind.type, faces);
  } else {
    grid->InsertNextCell(kind.type, ids);
  }
  return grid;
}

}  // namespace tensorray
