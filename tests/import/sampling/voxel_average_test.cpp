// Where cells are thinner than voxels, a voxel has the average of its part of the mesh.

#include "tools/import/sampling/voxel_average.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <vtkCellData.h>

#include "base/process/progress.h"
#include "tests/import/mesh_fixtures.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/sampling/mesh_sampling.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

constexpr double layer = 0.02;  ///< Thickness of the boundary layer: |T| falls with exp(−z / layer) from a wall.

/// The average of exp(−z / layer) over an interval.
double layer_average(double from, double to) {
  return layer * (std::exp(-from / layer) - std::exp(-to / layer)) / (to - from);
}

TensorGrid sampled(vtkDataSet& mesh, double voxel, SamplingReport& report) {
  SamplingSettings settings;
  settings.resolution = voxel;
  return sample_mesh(mesh, settings, Progress(), report);
}

TensorGrid sampled(vtkDataSet& mesh, double voxel) {
  SamplingReport report;
  return sampled(mesh, voxel, report);
}

/// A unit cube above a wall at z = 0. Cells grow away from the wall, where they are a thousandth thick.
vtkSmartPointer<vtkStructuredGrid> graded_mesh(const Map& map) {
  return curvilinear({5, 5, 61}, [&](const Vector3d& p) {
    const double graded = (std::exp(5 * p.z()) - 1) / (std::exp(5) - 1);
    return map(Vector3d(p.x(), p.y(), graded));
  });
}

void add_layer(vtkDataSet& mesh, const std::function<double(const Vector3d&)>& distance) {
  add_array<9>(mesh, tensor_array,
               [&](const Vector3d& p) { return flat(std::exp(-distance(p) / layer) * Matrix3d::Identity()); });
}

TEST(VoxelAverages, OfABoundaryLayerHaveLessErrorThanTheirCentres) {
  const auto mesh = graded_mesh([](const Vector3d& p) { return p; });
  add_layer(*mesh, [](const Vector3d& p) { return p.z(); });
  for (const double voxel : {0.11, 0.09, 0.07, 0.047}) {  // The rest on both sides of the cube gives other distances.
    double of_averages = 0, of_centres = 0;
    for_each_voxel(sampled(*mesh, voxel), [&](const Vector3d& p, const Matrix3d& tensor) {
      if (p.z() < voxel / 2 || p.z() > 0.5) return;  // Voxels that the mesh fills.
      const double truth = layer_average(p.z() - voxel / 2, p.z() + voxel / 2);
      of_averages += std::pow(tensor(0, 0) - truth, 2);
      of_centres += std::pow(std::exp(-p.z() / layer) - truth, 2);
    });
    EXPECT_LT(std::sqrt(of_averages), 0.1 * std::sqrt(of_centres)) << voxel;
  }
}

TEST(VoxelAverages, OfALinearFieldAreItsValuesAtTheCentresAlsoAtWalls) {
  for (const int type : {VTK_HEXAHEDRON, VTK_TETRA, VTK_WEDGE, VTK_PYRAMID, VTK_QUADRATIC_HEXAHEDRON}) {
    const auto mesh = unit_cube(type, 12, bent);
    add_array<9>(*mesh, tensor_array, [](const Vector3d& p) { return flat(linear_tensor(p)); });
    SamplingReport report;
    double worst = 0;
    for_each_voxel(sampled(*mesh, 0.25, report), [&](const Vector3d& p, const Matrix3d& tensor) {
      worst = std::max(worst, (tensor - linear_tensor(p)).cwiseAbs().maxCoeff());
    });
    EXPECT_EQ(report.active, 125u) << type;
    EXPECT_LT(worst, 5e-5) << type;
  }
}

TEST(VoxelAverages, WhereCellsAreAsLargeAsVoxelsCentresCount) {
  const auto mesh = unit_cube(VTK_HEXAHEDRON, 4, [](const Vector3d& p) { return p; });
  const auto value = [](const Vector3d& p) { return std::sin(9 * p.x()); };
  add_array<9>(*mesh, tensor_array, [&](const Vector3d& p) { return flat(value(p) * Matrix3d::Identity()); });
  for_each_voxel(sampled(*mesh, 0.25), [&](const Vector3d& p, const Matrix3d& tensor) {
    EXPECT_EQ(static_cast<float>(tensor(0, 0)), static_cast<float>(value(p)));
  });
}

TEST(VoxelAverages, AreTheSameBitsOnAnyNumberOfThreads) {
  const auto mesh = graded_mesh(bent);
  add_layer(*mesh, [](const Vector3d& p) { return p.z(); });
  std::vector<TensorGrid> grids;
  for (const std::size_t threads : {1u, 2u, 3u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    grids.push_back(sampled(*mesh, 0.06));
  }
  for (std::size_t i = 1; i < grids.size(); ++i) {
    ASSERT_EQ(grids[i].blocks.size(), grids[0].blocks.size());
    for (std::size_t k = 0; k < grids[0].blocks.size(); ++k)
      EXPECT_TRUE(grids[i].blocks[k].values == grids[0].blocks[k].values);
  }
}

/// Twelve cubes in a row; a cell array `T` is 1 in all of them but one, which has `lone`.
vtkSmartPointer<vtkStructuredGrid> row_with_lone_cell(double lone) {
  const auto mesh = curvilinear({13, 2, 2}, [](const Vector3d& p) { return Vector3d(12 * p.x(), p.y(), p.z()); });
  vtkNew<vtkDoubleArray> array;
  array->SetName("T");
  array->SetNumberOfComponents(9);
  for (int cell = 0; cell < 12; ++cell)
    array->InsertNextTuple(flat((cell == 5 ? lone : 1.0) * Matrix3d::Identity()).data());
  mesh->GetCellData()->AddArray(array);
  return mesh;
}

TEST(CellValues, LossIsMeasuredOnTheFilesOwnValues) {
  const auto mesh = row_with_lone_cell(8);
  SamplingReport report;
  sampled(*with_tensors(*mesh, {"T", true}, Take::tensor, {}), 0.5, report);
  EXPECT_TRUE(report.of_cells);
  EXPECT_NEAR(report.native_peak, 8 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(report.native_median, std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(report.sampled_peak, 4.5 * std::sqrt(3.0), 1e-5);  // Points have the mean of their cells.
}

TEST(CellValues, ConstantGivesEachVoxelItsCell) {
  const auto mesh = row_with_lone_cell(8);
  SamplingReport report;
  const TensorGrid grid =
      sampled(*with_tensors(*mesh, {"T", true}, Take::tensor, {}, CellValues::constant), 0.4, report);
  EXPECT_NEAR(report.sampled_peak, 8 * std::sqrt(3.0), 1e-5);
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    if (std::abs(p.x() - std::round(p.x())) > 1e-3) {  // On a face, the first cell counts.
      EXPECT_EQ(tensor(1, 1), p.x() > 5 && p.x() < 6 ? 8 : 1) << p;
    }
  });
  EXPECT_THROW(with_tensors(*mesh, {"T", true}, Take::gradient, {}, CellValues::constant), std::invalid_argument);
}

TEST(CellValues, ConstantInCellsThinnerThanVoxelsAreAveraged) {
  const auto mesh = row_with_lone_cell(8);
  const auto tensors = with_tensors(*mesh, {"T", true}, Take::tensor, {}, CellValues::constant);
  SamplingSettings settings;
  settings.resolution = Vector3i(3, 2, 2);  // Voxels of 6 x 1 x 1, centred at 0, 6 and 12.
  SamplingReport report;
  const TensorGrid grid = sample_mesh(*tensors, settings, Progress(), report);
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    if (std::abs(p.x() - 6) < 1e-6) {
      EXPECT_NEAR(tensor(0, 0), (8 + 5) / 6.0, 1e-3);
    }
  });
}

}  // namespace
}  // namespace tensorray
