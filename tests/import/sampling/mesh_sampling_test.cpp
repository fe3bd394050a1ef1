#include "tools/import/sampling/mesh_sampling.h"

#include <vtkAppendFilter.h>

#include "tests/import/cell_types.h"
#include "tests/import/mesh_files.h"
#include "tests/import/sampling/sampled.h"
#include "tools/import/meshes/mesh_cell.h"
#include "tools/import/sampling/cell_parts.h"
#include "tools/import/sampling/sampling_lattice.h"
#include "tools/import/sampling/voxel_average.h"
#include "tools/import/vtk/vtk_data_sets.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;

/// The greatest difference of a component from the value at its voxel.
template <class Value>
double worst_error(const TensorGrid& grid, const Value& value) {
  double worst = 0;
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    worst = std::max(worst, (tensor - value(p)).cwiseAbs().maxCoeff());
  });
  return worst;
}

void expect_linear(const TensorGrid& grid) {
  // Single precision of numbers up to 23, and a position error of at most 1e-6 of the diagonal.
  EXPECT_LT(worst_error(grid, linear_tensor), 5e-6);
}

// Spacings of 1/(n − 1), and cells of edge 1/3, put voxels on faces, edges and corners of the cells and of the cube.
// The curved faces of a bent quadratic cell fit its neighbours, because its middle nodes are bent too.
TEST(MeshSampling, SamplesALinearFieldExactlyAtEveryVoxelOfACube) {
  for (const int type : families)
    for (const bool is_bent : {false, true}) {
      if (is_bent && type == VTK_PYRAMID) continue;  // Its sides would be gaps.
      SCOPED_TRACE(testing::Message() << type << is_bent);
      const auto mesh = with_field(unit_cube(type, 3, is_bent ? Map(bent) : unchanged));
      const auto [grid, report] = sampled(*mesh, resolution(13));
      EXPECT_EQ(report.size, Vector3i::Constant(13));
      EXPECT_EQ(report.active, 13u * 13 * 13);
      EXPECT_EQ(grid.active_voxels(), report.active);
      expect_linear(grid);
    }
}

TEST(MeshSampling, QuadraticCellsGiveAQuadraticFieldExactly) {
  const auto value = [](const Vector3d& p) { return Matrix3d(linear_tensor(p) * (1 + p.x() - 2 * p.y() + p.z())); };
  const auto mesh = with_field(unit_cube(VTK_QUADRATIC_TETRA, 2, unchanged), value);
  EXPECT_LT(worst_error(sampled(*mesh, resolution(15)).grid, value), 1e-5);
}

TEST(MeshSampling, ResolutionIsOfTheLongestEdgeOrOfEachOrAVoxelOrChosen) {
  const auto mesh = with_field(
      unit_cube(VTK_HEXAHEDRON, 4, [](const Vector3d& p) { return Vector3d(2 * p.x() + 1, p.y(), p.z() / 2); }));
  const auto check = [&](const SamplingSettings& settings, const Vector3i& size, const Vector3d& voxel) {
    SCOPED_TRACE(size.transpose());
    const auto [grid, report] = sampled(*mesh, settings);
    EXPECT_EQ(report.size, size);
    EXPECT_TRUE(report.voxel.isApprox(voxel, 1e-12)) << report.voxel;
    EXPECT_EQ(report.active, static_cast<std::size_t>(size.prod()));
    EXPECT_TRUE((grid.to_world * Vector3d::Zero()).isApprox(Vector3d(1, 0, 0), 1e-12));
    EXPECT_TRUE((grid.to_world * (size - Vector3i::Ones()).cast<double>()).isApprox(Vector3d(3, 1, 0.5), 1e-12));
    EXPECT_NEAR(report.volume, 1, 1e-12);
    expect_linear(grid);
  };
  check(resolution(21), {21, 11, 6}, {0.1, 0.1, 0.1});
  check(resolution(Vector3i(5, 6, 7)), {5, 6, 7}, {0.5, 0.2, 0.5 / 6});
  // A voxel of another size than the body's parts becomes smaller: the field has the faces, and no more.
  check(resolution(0.3), {8, 5, 3}, {2.0 / 7, 0.25, 0.25});
  check(resolution(0.667), {4, 3, 2}, {2.0 / 3, 0.5, 0.5});
  check(resolution(2.0), {2, 2, 2}, {2, 1, 0.5});
  // The cells are 1/2 x 1/4 x 1/8: a cube of the same volume has an edge of 1/4.
  check({}, {9, 5, 5}, {0.25, 0.25, 0.125});
}

// Without options, voxels are on the faces of a thin body, and there are four cells of them across it wherever it lies.
TEST(MeshSampling, ThinBodiesGetVoxelsAcrossThem) {
  struct Case {
    const char* name;
    Map map;
    double thickness;  ///< 0: that of its box.
    double volume;
  };
  const auto turn = Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized());
  const Case cases[] = {
      {"plate", [](const Vector3d& p) { return Vector3d(10 * p.x(), 7.3 * p.y(), 0.5 * p.z()); }, 0, 36.5},
      {"turned", [&](const Vector3d& p) { return turn * Vector3d(10 * p.x(), 7.3 * p.y(), 0.5 * p.z()); }, 0.45, 36.5},
      {"tube",
       [](const Vector3d& p) {
         const double r = 4 + 0.5 * p.z(), angle = 6.2 * p.y();
         return Vector3d(r * std::cos(angle), r * std::sin(angle), 10 * p.x());
       },
       0.47, 0.5 * 6.2 * (4.5 * 4.5 - 4 * 4) * 10}};
  for (const Case& each : cases) {
    SCOPED_TRACE(each.name);
    const auto mesh = with_field(curvilinear({11, 41, 3}, each.map));
    SamplingSettings settings;
    settings.thickness = each.thickness;
    const auto [grid, report] = sampled(*mesh, settings);
    const Solid solid = solid_part(*mesh);
    const Vector3d last = grid.to_world * (report.size - Vector3i::Ones()).cast<double>();
    EXPECT_LT((grid.to_world.translation() - solid.bounds.min()).norm() + (last - solid.bounds.max()).norm(), 1e-9);
    if (each.thickness == 0)
      EXPECT_EQ(report.size.z(), 5);
    else
      EXPECT_LE(report.voxel.maxCoeff(), each.thickness / 4 * 1.001);
    EXPECT_NEAR(report.volume, each.volume, (each.thickness == 0 ? 1e-6 : 0.1) * report.volume);
  }
}

// A turned plate that is too large for such voxels in all of its box: finer levels have them, whatever the linear field
// needs.
TEST(MeshSampling, LargeThinBodiesGetThemByLevels) {
  const auto turn = Eigen::AngleAxisd(0.4, Vector3d(1, 2, 0).normalized());
  const auto mesh = with_field(
      curvilinear({41, 31, 2}, [&](const Vector3d& p) { return turn * Vector3d(60 * p.x(), 45 * p.y(), p.z()); }));
  SamplingSettings settings;
  settings.thickness = 0.96;
  const SamplingReport report = sampled(*mesh, settings).report;
  EXPECT_GT(report.voxel.maxCoeff(), settings.thickness / 4);
  ASSERT_FALSE(report.finer.empty());
  EXPECT_LE(report.finer.back().voxel, settings.thickness / 4 * 1.03);
}

TEST(MeshSampling, ChosenVoxelsAreAtMostTwoToThe21) {
  // 200 thin slices beside a long cell: for the median cell, 10^7 voxels would be needed.
  const auto mesh = with_field(curvilinear(
      {202, 2, 2}, [](const Vector3d& p) { return Vector3d(p.x() < 0.999 ? p.x() * 1e-4 : 1.0, p.y(), p.z()); }));
  SamplingSettings settings;
  settings.levels = 1;
  const double voxels = sampling_lattice(*mesh, solid_part(*mesh), settings).size.cast<double>().prod();
  EXPECT_LE(voxels, 1 << 21);
  EXPECT_GE(voxels, 0.9 * (1 << 21));
}

TEST(MeshSampling, BoundsCropTheLatticeAndTheReport) {
  const auto mesh = with_field(unit_cube(VTK_HEXAHEDRON, 4, unchanged));
  SamplingSettings settings = resolution(0.125);
  settings.bounds = AlignedBox3d(Vector3d(0.25, 0.25, 0), Vector3d(0.5, 0.5, 2));
  const auto [grid, report] = sampled(*mesh, settings);
  EXPECT_EQ(report.size, Vector3i(3, 3, 17));
  EXPECT_EQ(report.active, 3u * 3u * 9u);  // the mesh ends at z = 1
  expect_linear(grid);
  double peak = 0;  // At a corner of what remains.
  for (const double x : {0.25, 0.5})
    for (const double y : {0.25, 0.5})
      for (const double z : {0, 1}) peak = std::max(peak, linear_tensor({x, y, z}).norm());
  EXPECT_NEAR(report.native_peak, peak, 1e-12);
}

TEST(MeshSampling, ReportsThePeakThatCoarseVoxelsMiss) {
  // |T| = √3 max(0, 1 − 8 |x − 1/16|) on cells of edge 1/16. Voxels of edge 1/8 miss the peak by half a tooth, where
  // |T| has half its peak value.
  const auto mesh = with_field(unit_cube(VTK_HEXAHEDRON, 16, unchanged), [](const Vector3d& p) {
    return Matrix3d(Matrix3d::Identity() * std::max(0.0, 1 - 8 * std::abs(p.x() - 0.0625)));
  });
  SamplingSettings coarse = resolution(9);
  coarse.levels = 1;
  const SamplingReport report = sampled(*mesh, coarse).report;
  EXPECT_NEAR(report.native_peak, std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(report.sampled_peak, std::sqrt(3.0) / 2, 1e-6);
  EXPECT_EQ(report.sampled_median, 0);
  EXPECT_NEAR(sampled(*mesh, resolution(17)).report.sampled_peak, std::sqrt(3.0), 1e-6);
}

TEST(MeshSampling, OfCellsThatListMorePointsThanTheirTypeHasTheFirstCount) {
  const auto quadratic = unit_cube(VTK_QUADRATIC_HEXAHEDRON, 2, unchanged);
  const auto mesh = Grid::New();
  mesh->SetPoints(quadratic->GetPoints());
  for (vtkIdType i = 0; i < quadratic->GetNumberOfCells(); ++i)
    mesh->InsertNextCell(VTK_HEXAHEDRON, quadratic->GetCell(i)->GetPointIds());
  vtkIdType point = 0;
  add_array<9>(*mesh, tensor_array, [&](const Vector3d& p) {
    return Eigen::Matrix<double, 9, 1>(flat(linear_tensor(p)) * (point++ % 20 < 8 ? 1 : 0));
  });
  const auto [grid, report] = sampled(*mesh, resolution(9));
  expect_linear(grid);
  EXPECT_EQ(report.active, 9u * 9u * 9u);
  EXPECT_GT(report.native_median, 10);  // the zeros at middle nodes do not count
}

TEST(MeshSampling, OverlappingCellsGiveTheSameOnAnyNumberOfThreads) {
  vtkNew<vtkAppendFilter> both;
  both->AddInputData(unit_cube(VTK_TETRA, 6, unchanged));
  both->AddInputData(unit_cube(VTK_HEXAHEDRON, 5, bent));
  both->Update();
  const Grid mesh = both->GetOutput();
  double point = 0;
  add_array<9>(*mesh, tensor_array, [&](const Vector3d&) {
    point += 1;
    return Eigen::Matrix<double, 9, 1>(Eigen::Matrix<double, 9, 1>::LinSpaced(point, point + 1.0));
  });
  expect_same_on_threads(*mesh, resolution(40));
}

TEST(MeshSampling, StopsWhenCancelledAndReportsToTheCaller) {
  const auto mesh = with_field(unit_cube(VTK_HEXAHEDRON, 3, unchanged));
  SamplingReport report;
  Progress progress;
  std::uint64_t last = 0, total = 0;
  progress.report = [&](const std::string&, std::uint64_t done, std::uint64_t of) { last = done, total = of; };
  sample_mesh(*mesh, resolution(33), progress, report);
  EXPECT_EQ(last, 125u);
  EXPECT_EQ(total, 125u);
  progress.cancelled = true;
  EXPECT_THROW(sample_mesh(*mesh, resolution(33), progress, report), Cancelled);
}

TEST(MeshSampling, RefusesWhatCannotBeSampled) {
  const auto cube = with_field(unit_cube(VTK_HEXAHEDRON, 1, unchanged));
  const auto flat_mesh =
      with_field(curvilinear({4, 4, 1}, [](const Vector3d& p) { return Vector3d(p.x(), p.y(), 0); }));
  EXPECT_THAT([&] { sampled(*flat_mesh); }, ThrowsMessage<std::invalid_argument>(HasSubstr("flat")));
  const auto refuses = [&](const SamplingSettings& settings, const char* part) {
    EXPECT_THAT([&] { sampled(*cube, settings); }, ThrowsMessage<std::invalid_argument>(HasSubstr(part)));
  };
  refuses(resolution(1), "--resolution");
  refuses(resolution(1025), "2^30");
  refuses(resolution(Vector3i(4, 0, 4)), "--resolution");
  for (const double voxel : {0.0, -1.0, 3.0, double(NAN)}) refuses(resolution(voxel), "--voxel-size");
  refuses(resolution(1e-300), "2^30");
  SamplingSettings settings;
  settings.bounds = AlignedBox3d(Vector3d(2, 2, 2), Vector3d(3, 3, 3));
  refuses(settings, "nothing of the mesh is inside, which goes from (0, 0, 0) to (1, 1, 1)");
  settings.bounds = AlignedBox3d(Vector3d(0, 0, 0), Vector3d(1, 0, 1));
  refuses(settings, "is not a box");
  with_field(cube, [](const Vector3d&) { return Matrix3d(Matrix3d::Constant(NAN)); });
  refuses(resolution(3), "all 8 points have NaN or infinite tensors");
}

// Where cells are thinner than voxels, a voxel has the average of its part of the mesh.

constexpr double layer = 0.02;  ///< Thickness of the boundary layer: |T| falls with exp(−z / layer) from a wall.

/// The average of exp(−z / layer) over an interval.
double layer_average(double from, double to) {
  return layer * (std::exp(-from / layer) - std::exp(-to / layer)) / (to - from);
}

/// Such a layer on a wall at z = 0, in a unit cube. Cells grow away from the wall, where they are a thousandth thick.
vtkSmartPointer<vtkStructuredGrid> mesh_of_layer(const Map& map) {
  const auto mesh = curvilinear({5, 5, 61}, [&](const Vector3d& p) {
    return map(Vector3d(p.x(), p.y(), std::expm1(5 * p.z()) / std::expm1(5)));
  });
  return with_field(mesh, [](const Vector3d& p) { return Matrix3d(std::exp(-p.z() / layer) * Matrix3d::Identity()); });
}

TEST(VoxelAverages, OfABoundaryLayerHaveLessErrorThanTheirCentres) {
  const auto mesh = mesh_of_layer(unchanged);
  for (const double most : {0.11, 0.09, 0.07, 0.047}) {
    const double voxel = 1 / std::ceil(1 / most);  // Voxels are on both faces of the cube.
    double of_averages = 0, of_centres = 0;
    for_each_voxel(sampled(*mesh, resolution(voxel)).grid, [&](const Vector3d& p, const Matrix3d& tensor) {
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
    const auto mesh = with_field(unit_cube(type, 12, bent));
    const auto [grid, report] = sampled(*mesh, resolution(0.25));
    EXPECT_LT(worst_error(grid, linear_tensor), 5e-5) << type;
    EXPECT_EQ(report.active, 125u) << type;
  }
}

TEST(VoxelAverages, WhereCellsAreAsLargeAsVoxelsCentresCount) {
  const auto value = [](const Vector3d& p) { return Matrix3d(std::sin(9 * p.x()) * Matrix3d::Identity()); };
  const auto mesh = with_field(unit_cube(VTK_HEXAHEDRON, 4, unchanged), value);
  for_each_voxel(sampled(*mesh, resolution(0.25)).grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    EXPECT_EQ(tensor.cast<float>(), value(p).cast<float>());
  });
}

TEST(VoxelAverages, AreTheSameBitsOnAnyNumberOfThreads) {
  expect_same_on_threads(*mesh_of_layer(bent), resolution(0.12));
}

/// Twelve cubes in a row; a cell array `T` is 1 in all of them but one, which has 8.
vtkSmartPointer<vtkStructuredGrid> row_with_lone_cell() {
  const auto mesh = curvilinear({13, 2, 2}, [](const Vector3d& p) { return Vector3d(12 * p.x(), p.y(), p.z()); });
  add_cell_array<9>(*mesh, "T", [&](vtkIdType cell) { return flat((cell == 5 ? 8 : 1) * Matrix3d::Identity()); });
  return mesh;
}

TEST(CellValues, LossIsMeasuredOnTheFilesOwnValues) {
  const auto tensors = with_tensors(*row_with_lone_cell(), {"T", true}, Take::tensor, {});
  const SamplingReport report = sampled(*tensors, resolution(0.5)).report;
  EXPECT_TRUE(report.of_cells);
  EXPECT_NEAR(report.native_peak, 8 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(report.native_median, std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(report.sampled_peak, 4.5 * std::sqrt(3.0), 1e-5);  // Points have the mean of their cells.
}

TEST(CellValues, ConstantGivesEachVoxelItsCellOrTheAverageOfThinnerOnes) {
  const auto mesh = row_with_lone_cell();
  const auto tensors = with_tensors(*mesh, {"T", true}, Take::tensor, {}, CellValues::constant);
  const auto [grid, report] = sampled(*tensors, resolution(0.4));
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    if (std::abs(p.x() - std::round(p.x())) > 1e-3) {  // On a face, the first cell counts.
      EXPECT_EQ(tensor(1, 1), p.x() > 5 && p.x() < 6 ? 8 : 1) << p;
    }
  });
  EXPECT_NEAR(report.sampled_peak, 8 * std::sqrt(3.0), 1e-5);
  // Voxels of 6 x 1 x 1, centred at 0, 6 and 12.
  for_each_voxel(sampled(*tensors, resolution(Vector3i(3, 2, 2))).grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    if (std::abs(p.x() - 6) < 1e-6) {
      EXPECT_NEAR(tensor(0, 0), (8 + 5) / 6.0, 1e-3);
    }
  });
  EXPECT_THROW(with_tensors(*mesh, {"T", true}, Take::gradient, {}, CellValues::constant), std::invalid_argument);
}

// Every three-dimensional type of cell that VTK has is sampled, and divided into parts.

const Affine3d to_oblique =
    Eigen::Translation3d(3, -2, 5) * (Matrix3d() << 1.1, 0.2, -0.1, 0.1, 0.9, 0.25, -0.3, 0.15, 1.3).finished();

class EveryCellType : public ::testing::TestWithParam<CellKind> {
 protected:
  const Grid mesh_ = with_field(one_cell(GetParam(), to_oblique));
  const double volume_ = parametric_volume(GetParam()) * to_oblique.linear().determinant();
};

TEST_P(EveryCellType, SampledVolumeIsThatOfTheCell) {
  const auto [grid, report] = sampled(*mesh_, resolution(14));
  EXPECT_NEAR(static_cast<double>(report.active) * report.voxel.prod(), volume_, 0.12 * volume_);
  EXPECT_LT(worst_error(grid, linear_tensor), 5e-5);
}

TEST_P(EveryCellType, PartsHaveItsVolumeAndCentroid) {
  MeshCell cell;
  ASSERT_TRUE(cell.load(*mesh_, 0));
  const AlignedBox3d all(Vector3d::Constant(-10), Vector3d::Constant(10));
  for (const double longest : {9.0, 0.2}) {
    double sum = 0;
    visit_parts(cell, Vector3d::Constant(longest), all, [&](const CellPart& part) {
      Vector3d position = Vector3d::Zero();
      Matrix3d edges = Matrix3d::Zero();
      for (int i = 0; i < cell.points(); ++i) {
        position += part.weights(0, i) * cell.positions().col(i);
        edges += cell.positions().col(i) * part.weights.col(i).tail<3>().transpose();
      }
      EXPECT_LT((position - part.position).norm(), 1e-5);
      EXPECT_LT((edges - part.edges).norm(), 1e-5);
      sum += part.volume;
    });
    EXPECT_NEAR(sum, volume_, 1e-5 * volume_) << longest;
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
    EXPECT_THAT(error_of([&] { check_geometry(*grid, "a.vtu"); }), HasSubstr(part)) << type;
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
