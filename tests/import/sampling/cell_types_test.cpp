// Every three-dimensional type of cell that VTK has is sampled, and divided into parts.

#include "tests/import/cell_types.h"

#include <gtest/gtest.h>

#include "base/process/progress.h"
#include "tests/import/mesh_files.h"
#include "tests/import/mesh_fixtures.h"
#include "tools/import/meshes/mesh_cell.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/sampling/cell_parts.h"
#include "tools/import/sampling/mesh_sampling.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

class EveryCellType : public ::testing::TestWithParam<CellKind> {
 protected:
  static Eigen::Affine3d oblique() {
    Eigen::Affine3d map;
    map.linear() << 1.1, 0.2, -0.1, 0.1, 0.9, 0.25, -0.3, 0.15, 1.3;
    map.translation() << 3, -2, 5;
    return map;
  }
};

TEST_P(EveryCellType, SampledVolumeIsThatOfTheCell) {
  const auto mesh = one_cell(GetParam(), oblique());
  add_array<9>(*mesh, tensor_array, [](const Vector3d& p) { return flat(linear_tensor(p)); });
  SamplingSettings settings;
  settings.resolution = 14;
  SamplingReport report;
  const TensorGrid grid = sample_mesh(*mesh, settings, Progress(), report);
  const double volume = parametric_volume(GetParam()) * oblique().linear().determinant();
  EXPECT_NEAR(static_cast<double>(report.active) * report.voxel.prod(), volume, 0.12 * volume);
  double worst = 0;
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    worst = std::max(worst, (tensor - linear_tensor(p)).cwiseAbs().maxCoeff());
  });
  EXPECT_LT(worst, 5e-5);
}

TEST_P(EveryCellType, PartsHaveItsVolumeAndCentroid) {
  const auto mesh = one_cell(GetParam(), oblique());
  MeshCell cell;
  ASSERT_TRUE(cell.load(*mesh, 0));
  const Eigen::AlignedBox3d all(Vector3d::Constant(-10), Vector3d::Constant(10));
  const double volume = parametric_volume(GetParam()) * oblique().linear().determinant();
  for (const double longest : {9.0, 0.2}) {
    double sum = 0;
    visit_parts(cell, Vector3d::Constant(longest), all, [&](const CellPart& part) {
      Vector3d position = Vector3d::Zero();
      for (int i = 0; i < cell.points(); ++i)
        position += part.weights[static_cast<std::size_t>(i)] * cell.positions().col(i);
      EXPECT_LT((position - part.position).norm(), 1e-5);
      Eigen::Matrix3d edges = Eigen::Matrix3d::Zero();
      for (int i = 0; i < cell.points(); ++i) edges += cell.positions().col(i) * part.changes.row(i);
      EXPECT_LT((edges - part.edges).norm(), 1e-5);
      sum += part.volume;
    });
    EXPECT_NEAR(sum, volume, 1e-5 * volume) << longest;
  }
}

TEST(CellTypes, WhatCannotBeReadIsRefusedByName) {
  const auto refuses = [](int type, int count, const char* part) {
    const auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
    vtkNew<vtkPoints> points;
    vtkNew<vtkIdList> ids;
    for (int i = 0; i < count; ++i) ids->InsertNextId(points->InsertNextPoint(i % 2, i / 2 % 2, i / 4));
    grid->SetPoints(points);
    grid->InsertNextCell(type, ids);
    EXPECT_NE(error_of([&] { check_geometry(*grid, "a.vtu"); }).find(part), std::string::npos) << type;
  };
  refuses(VTK_LAGRANGE_PYRAMID, 5, "cells of type 74 (vtkLagrangePyramid), which cannot be read");
  refuses(VTK_BEZIER_PYRAMID, 5, "cells of type 81 (vtkBezierPyramid), which cannot be read");
  refuses(VTK_BEZIER_WEDGE, 6, "cells of type 80 (vtkBezierWedge), which cannot be read");
  refuses(200, 8, "cells of type 200, which cannot be read");
  refuses(VTK_LAGRANGE_HEXAHEDRON, 9, "has 9 points, which fit no order of its type");
  refuses(VTK_BEZIER_TETRAHEDRON, 5, "has 5 points, which fit no order of its type");
  refuses(VTK_LAGRANGE_WEDGE, 7, "has 7 points, which fit no order of its type");
}

INSTANTIATE_TEST_SUITE_P(Types, EveryCellType, ::testing::ValuesIn(solid_cell_kinds()),
                         [](const auto& test) { return name_of(test.param); });

}  // namespace
}  // namespace tensorray
