#pragma once
/// Meshes with a velocity U at cells, and what is imported of its gradient.

#include <array>
#include <functional>
#include <map>

#include "tests/import/imported.h"
#include "tests/import/vtk_files.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray::mesh_fixtures {

using Velocity = std::function<Vector3d(const Vector3d&)>;

inline Matrix3d shear() { return (Matrix3d() << 1, 2, 3, -4, 5, 6, 7, -8, 10).finished(); }

inline Vector3d linear(const Vector3d& p) { return shear() * p + Vector3d(0.3, -0.1, 0.2); }

inline Vector3d oblique(const Vector3d& p) { return {2 * p.x() + 0.3 * p.y(), p.y() - 0.2 * p.z(), 0.5 * p.z()}; }

/// The mean of the corners: the centroid of a parallelepiped, a simplex or a prism.
inline Vector3d mean_of(vtkCell& cell) {
  Vector3d sum = Vector3d::Zero();
  const auto count = static_cast<int>(cell.GetNumberOfPoints());
  for (int i = 0; i < count; ++i) sum += Vector3d(cell.GetPoints()->GetPoint(i)) / count;
  if (cell.GetCellType() != VTK_PYRAMID) return sum;
  return 1.25 * 0.75 * sum + (0.25 - 0.1875) * Vector3d(cell.GetPoints()->GetPoint(4));
}

inline void add_velocity(vtkDataSet& mesh, const Velocity& velocity,
                         const std::function<Vector3d(vtkCell&)>& centre = mean_of) {
  add_cell_array<3>(mesh, "U", [&](vtkIdType i) { return velocity(centre(*mesh.GetCell(i))); });
}

inline TensorGrid gradients(const std::filesystem::path& file, double voxel, Take take = Take::gradient) {
  return imported(file, array_settings("U", take, voxel)).grid;
}

inline double error_in(const TensorGrid& grid, const std::function<Matrix3d(const Vector3d&)>& expected) {
  EXPECT_GT(grid.active_voxels(), 20U);
  double worst = 0;
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    worst = std::max(worst, (tensor - expected(p)).cwiseAbs().maxCoeff());
  });
  return worst;
}

/// Expects that both have the same voxels, and tensors that differ by less than 1e-6.
inline void expect_alike(const TensorGrid& grid, const TensorGrid& other, const std::string& name) {
  std::map<std::array<double, 3>, Matrix3d> expected;
  for_each_voxel(other, [&](const Vector3d& p, const Matrix3d& t) { expected[{p.x(), p.y(), p.z()}] = t; });
  EXPECT_LT(error_in(grid, [&](const Vector3d& p) { return expected.at({p.x(), p.y(), p.z()}); }), 1e-6) << name;
}

inline void expect_linear(const TensorGrid& grid, const std::string& name) {
  EXPECT_LT(error_in(grid, [](const Vector3d&) { return shear(); }), 2e-5) << name;
}

/// A grid of boxes with these coordinates along each axis, whose faces may also be divided.
inline Grid boxes(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z) {
  const auto lines = rectilinear_grid(x, y, z);
  auto grid = Grid::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (vtkIdType i = 0; i < lines->GetNumberOfPoints(); ++i) points->InsertNextPoint(lines->GetPoint(i));
  grid->SetPoints(points);
  for (vtkIdType i = 0; i < lines->GetNumberOfCells(); ++i) {
    vtkNew<vtkIdList> ids;
    for (const int corner : {0, 1, 3, 2, 4, 5, 7, 6}) ids->InsertNextId(lines->GetCell(i)->GetPointId(corner));
    grid->InsertNextCell(VTK_HEXAHEDRON, ids);
  }
  return grid;
}

inline std::vector<double> steps(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(from + (to - from) * i / count);
  return values;
}

/// Both grids, with points at equal positions once.
inline Grid joined(const Grid& a, const Grid& b) {
  return Grid(vtkUnstructuredGrid::SafeDownCast(one_data_set({a, b})));
}

/// A coarse cube beside eight small ones: its face at x = 1 is four faces of a polyhedron.
inline Grid polyhedra() {
  const Grid grid = joined(boxes({1, 1.5, 2}, {0, 0.5, 1}, {0, 0.5, 1}), boxes({0, 1}, {0, 1}, {0, 1}));
  auto result = Grid::New();
  result->SetPoints(grid->GetPoints());
  const auto p = [&](double x, double y, double z) { return grid->FindPoint(x, y, z); };
  std::vector<vtkIdType> faces;
  int count = 0;
  const auto face = [&](std::vector<vtkIdType> ids) {
    faces.push_back(static_cast<vtkIdType>(ids.size()));
    faces.insert(faces.end(), ids.begin(), ids.end());
    ++count;
  };
  for (const double y : {0.0, 0.5})
    for (const double z : {0.0, 0.5}) face({p(1, y, z), p(1, y + 0.5, z), p(1, y + 0.5, z + 0.5), p(1, y, z + 0.5)});
  face({p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)});
  for (const double s : {0.0, 1.0}) {
    face({p(0, s, 0), p(1, s, 0), p(1, s, 0.5), p(1, s, 1), p(0, s, 1)});
    face({p(0, 0, s), p(1, 0, s), p(1, 0.5, s), p(1, 1, s), p(0, 1, s)});
  }
  result->InsertNextCell(VTK_POLYHEDRON, count, faces.data());
  for (vtkIdType i = 0; i < 8; ++i)
    result->InsertNextCell(VTK_HEXAHEDRON, 8, grid->GetCell(i)->GetPointIds()->GetPointer(0));
  return result;
}

inline Vector3d middle_of(vtkCell& cell) {
  const double* const b = cell.GetBounds();
  return 0.5 * Vector3d(b[0] + b[1], b[2] + b[3], b[4] + b[5]);
}

}  // namespace tensorray::mesh_fixtures
