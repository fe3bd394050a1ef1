#pragma once
/// Meshes of a few cells with known shapes and values.

#include <functional>
#include <utility>

#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
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
  for (int k = 0; k < nodes.z(); ++k)
    for (int j = 0; j < nodes.y(); ++j)
      for (int i = 0; i < nodes.x(); ++i)
        points->InsertNextPoint(
            map(Vector3d(i, j, k).cwiseQuotient((nodes.array() - 1).cast<double>().matrix())).data());
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

/// The unit cube, divided into n³ cubes. Each cube becomes a hexahedron, 2 wedges, 6 pyramids, 6 tetrahedra or a
/// quadratic hexahedron, or is divided into quadratic tetrahedra.
inline Grid unit_cube(int cell_type, int n, const Map& map) {
  auto grid = Grid::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  grid->SetPoints(points);
  const auto cell = [&](int type, std::vector<Vector3d> corners) {
    std::vector<vtkIdType> ids;
    for (const Vector3d& corner : corners) ids.push_back(points->InsertNextPoint(map(corner).data()));
    grid->InsertNextCell(type, static_cast<vtkIdType>(ids.size()), ids.data());
  };
  const auto with_middles = [](std::vector<Vector3d> c, const std::vector<std::pair<int, int>>& edges) {
    for (const auto& [a, b] : edges)
      c.push_back(0.5 * (c[static_cast<std::size_t>(a)] + c[static_cast<std::size_t>(b)]));
    return c;
  };
  const std::vector<std::vector<std::size_t>> tetrahedra{{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                                                         {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  const std::vector<std::vector<std::size_t>> faces{{0, 1, 2, 3}, {7, 6, 5, 4}, {0, 4, 5, 1},
                                                    {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
  for (int i = 0; i < n * n * n; ++i) {
    std::vector<Vector3d> c;
    for (const auto& corner : {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(1, 1, 0), Vector3d(0, 1, 0),
                               Vector3d(0, 0, 1), Vector3d(1, 0, 1), Vector3d(1, 1, 1), Vector3d(0, 1, 1)})
      c.push_back((corner + Vector3d(i % n, i / n % n, i / n / n)) / n);
    if (cell_type == VTK_HEXAHEDRON || cell_type == VTK_LAGRANGE_HEXAHEDRON) cell(cell_type, c);
    if (cell_type == VTK_WEDGE) {
      cell(cell_type, {c[0], c[1], c[2], c[4], c[5], c[6]});
      cell(cell_type, {c[0], c[2], c[3], c[4], c[6], c[7]});
    }
    if (cell_type == VTK_PYRAMID)
      for (const auto& f : faces) cell(cell_type, {c[f[0]], c[f[1]], c[f[2]], c[f[3]], 0.5 * (c[0] + c[6])});
    if (cell_type == VTK_TETRA)
      for (const auto& t : tetrahedra) cell(cell_type, {c[t[0]], c[t[1]], c[t[2]], c[t[3]]});
    if (cell_type == VTK_QUADRATIC_TETRA)
      for (const auto& t : tetrahedra)
        cell(cell_type,
             with_middles({c[t[0]], c[t[1]], c[t[2]], c[t[3]]}, {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}));
    if (cell_type == VTK_QUADRATIC_HEXAHEDRON)
      cell(cell_type,
           with_middles(
               c, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}));
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
  array->SetNumberOfTuples(mesh.GetNumberOfPoints());
  for (vtkIdType i = 0; i < mesh.GetNumberOfPoints(); ++i) {
    Vector3d position;
    mesh.GetPoint(i, position.data());
    array->SetTuple(i, value(position).eval().data());
  }
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
