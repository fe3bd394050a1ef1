#pragma once
/// Meshes of a few cells with known shapes and values.

#include <functional>

#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkStructuredGrid.h>
#include <vtkUnstructuredGrid.h>

#include "base/constants.h"
#include "tests/volumes/grid_support.h"

namespace tensorray::mesh_fixtures {

using Map = std::function<Vector3d(const Vector3d&)>;
using Grid = vtkSmartPointer<vtkUnstructuredGrid>;

/// A curvilinear grid: the nodes of the unit cube, moved by `map`.
inline vtkSmartPointer<vtkStructuredGrid> curvilinear(const Vector3i& nodes, const Map& map) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (int i = 0; i < nodes.prod(); ++i) {
    const Vector3d index(i % nodes.x(), i / nodes.x() % nodes.y(), i / nodes.x() / nodes.y());
    points->InsertNextPoint(map(index.cwiseQuotient((nodes - Vector3i::Ones()).cast<double>())).data());
  }
  auto grid = vtkSmartPointer<vtkStructuredGrid>::New();
  grid->SetDimensions(nodes.data());
  grid->SetPoints(points);
  return grid;
}

inline Vector3d unchanged(const Vector3d& p) { return p; }

/// Bends the unit cube: moves its inner nodes, and keeps its faces in place.
inline Vector3d bent(const Vector3d& p) {
  const double s = 0.15 * std::sin(pi * p.x()) * std::sin(pi * p.y()) * std::sin(pi * p.z());
  return p + s * Vector3d(1, -0.7, 0.5);
}

inline std::vector<Vector3d> cube_corners() {
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}

/// The unit cube, divided into n³ cubes. Each cube becomes a hexahedron, 2 wedges, 6 pyramids, 6 tetrahedra or a
/// quadratic hexahedron, or is divided into quadratic tetrahedra.
inline Grid unit_cube(int cell_type, int n, const Map& map) {
  using Numbers = std::vector<std::vector<std::size_t>>;
  Numbers cells{{0, 1, 2, 3, 4, 5, 6, 7}};  // Their corners among those of a cube, whose middle is number 8.
  if (cell_type == VTK_WEDGE) cells = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
  if (cell_type == VTK_PYRAMID)
    cells = {{0, 1, 2, 3, 8}, {7, 6, 5, 4, 8}, {0, 4, 5, 1, 8}, {1, 5, 6, 2, 8}, {2, 6, 7, 3, 8}, {3, 7, 4, 0, 8}};
  if (cell_type == VTK_TETRA || cell_type == VTK_QUADRATIC_TETRA)
    cells = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  Numbers edges;  // With points in their middles.
  if (cell_type == VTK_QUADRATIC_TETRA) edges = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  if (cell_type == VTK_QUADRATIC_HEXAHEDRON)
    edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  auto grid = Grid::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  grid->SetPoints(points);
  for (int i = 0; i < n * n * n; ++i) {
    std::vector<Vector3d> corners;
    for (const Vector3d& corner : cube_corners())
      corners.push_back((corner + Vector3d(i % n, i / n % n, i / n / n)) / n);
    corners.push_back(0.5 * (corners[0] + corners[6]));
    for (const auto& numbers : cells) {
      std::vector<Vector3d> of_cell;
      for (const std::size_t number : numbers) of_cell.push_back(corners[number]);
      for (const auto& edge : edges) of_cell.push_back(0.5 * (of_cell[edge[0]] + of_cell[edge[1]]));
      vtkNew<vtkIdList> ids;
      for (const Vector3d& p : of_cell) ids->InsertNextId(points->InsertNextPoint(map(p).data()));
      grid->InsertNextCell(cell_type, ids);
    }
  }
  return grid;
}

/// Adds a point array with the values that `value` returns at the points.
template <int components>
void add_array(vtkDataSet& mesh, const std::string& name,
               const std::function<Eigen::Matrix<double, components, 1>(const Vector3d&)>& value) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  for (vtkIdType i = 0; i < mesh.GetNumberOfPoints(); ++i)
    array->InsertNextTuple(value(Vector3d(mesh.GetPoint(i))).data());
  mesh.GetPointData()->AddArray(array);
}

/// Adds a cell array with the values that `value` returns for the numbers of the cells.
template <int components, class Value>
void add_cell_array(vtkDataSet& mesh, const std::string& name, const Value& value) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  for (vtkIdType i = 0; i < mesh.GetNumberOfCells(); ++i)
    array->InsertNextTuple(Eigen::Matrix<double, components, 1>(value(i)).data());
  mesh.GetCellData()->AddArray(array);
}

/// A tensor with nine different linear functions as components.
inline Matrix3d linear_tensor(const Vector3d& p) {
  Matrix3d a, b, c, d;
  a << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  b << 3, -1, 2, 0.5, 4, 1, -2, 1, 5;
  c << -1, 2, 7, 3, 1, 0, 2, -4, 1;
  d << 2, 2, -3, 1, 6, -1, 0, 3, -2;
  return a + p.x() * b + p.y() * c + p.z() * d;
}

inline Eigen::Matrix<double, 9, 1> flat(const Matrix3d& tensor) {
  const Matrix3d columns = tensor.transpose();
  return Eigen::Map<const Eigen::Matrix<double, 9, 1>>(columns.data());
}

inline void for_each_voxel(const TensorGrid& grid, const std::function<void(const Vector3d&, const Matrix3d&)>& visit) {
  for_each_active(grid, [&](const Vector3i& index, const Matrix3f& tensor) {
    visit(grid.to_world * index.cast<double>(), tensor.cast<double>());
  });
}

}  // namespace tensorray::mesh_fixtures
