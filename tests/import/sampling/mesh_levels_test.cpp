// Levels of finer voxels, as the cells of a mesh ask.

#include "tests/import/sampling/sampled.h"

namespace tensorray {
namespace {

using namespace mesh_fixtures;
using Profile = std::function<double(const Vector3d&)>;

/// Cells become thin towards x = 0: from 0.27 down to 0.0025, if they are 16.
Vector3d graded(const Vector3d& p) { return {std::expm1(5 * p.x()) / std::expm1(5), p.y(), p.z()}; }

/// Cells become small towards the centre of the cube along each axis: a sixth of those of an even mesh.
Vector3d towards_centre(const Vector3d& p) {
  return (p.array() - 0.5).unaryExpr([](double t) { return 0.5 + t * (1 + 20 * t * t) / 6; }).matrix();
}

double thin_layer(const Vector3d& p) { return std::exp(-p.x() / 0.05); }
double fine_spot(const Vector3d& p) { return std::exp(-(p - Vector3d::Constant(0.5)).squaredNorm() / (0.06 * 0.06)); }

Grid mesh_of(int type, int n, const Map& map, const Profile& profile) {
  return with_field(unit_cube(type, n, map),
                    [&](const Vector3d& p) { return Matrix3d(Matrix3d::Identity() * profile(p)); });
}

/// What voxels of a level differ from a profile by at most, and the farthest of their centres along x.
std::pair<double, double> worst_and_farthest(const TensorGrid& grid, const Profile& profile) {
  double worst = 0, farthest = 0;
  for_each_voxel(grid, [&](const Vector3d& p, const Matrix3d& tensor) {
    worst = std::max(worst, (tensor - Matrix3d::Identity() * profile(p)).cwiseAbs().maxCoeff());
    farthest = std::max(farthest, p.x());
  });
  return {worst, farthest};
}

TEST(MeshLevels, ALayerAtAWallHasFinerVoxelsInCellsOfEveryFamily) {
  for (const int type : families) {
    SCOPED_TRACE(type);
    const auto column = [](const Vector3d& p) { return Vector3d(graded(p).cwiseProduct(Vector3d(1, 0.5, 0.5))); };
    const Grid mesh = mesh_of(type, 12, column, thin_layer);
    SamplingSettings single = resolution(1.0 / 16), exact = single;
    single.levels = 1;
    exact.error = 0.002;
    const Sampled one = sampled(*mesh, single), all = sampled(*mesh, exact);
    EXPECT_TRUE(one.grid.finer.empty());
    ASSERT_GE(all.grid.finer.size(), 2u);
    for (std::size_t level = 1; level <= all.grid.finer.size(); ++level) {
      EXPECT_NEAR(all.report.finer[level - 1].voxel, 1.0 / 16 / std::pow(2, level), 1e-9);
      const auto [worst, farthest] = worst_and_farthest(level_of(all.grid, level), thin_layer);
      if (level > 1) {
        EXPECT_LT(farthest, 0.5) << level;  // Where cells are larger than 1/32, or the layer has ended.
      }
      EXPECT_LT(worst, level == 1 ? 0.05 : 0.03) << level;
    }
    EXPECT_GT(all.report.sampled_peak, 0.97 * all.report.native_peak);
    EXPECT_LT(one.report.sampled_peak, all.report.sampled_peak);
    for (std::size_t i = 0; i < one.grid.blocks.size(); ++i)  // Level 0 alone is the field of one level.
      EXPECT_TRUE(one.grid.blocks[i].values == all.grid.blocks[i].values);
  }
}

TEST(MeshLevels, LinearFieldsEvenCellsAndLargeCellsHaveOneLevel) {
  for (const int type : families) {
    SCOPED_TRACE(type);
    const Grid linear = with_field(unit_cube(type, 12, graded));
    EXPECT_TRUE(sampled(*linear, resolution(0.08)).grid.finer.empty());
    const Grid even = mesh_of(type, 12, unchanged, thin_layer);
    if (type == VTK_PYRAMID || type == VTK_TETRA || type == VTK_QUADRATIC_TETRA) continue;  // Thinner than cubes.
    for (const double voxel : {1.0 / 12, 0.03})
      EXPECT_TRUE(sampled(*even, resolution(voxel)).grid.finer.empty()) << voxel;
  }
}

TEST(MeshLevels, AFineSpotIsRefinedWhereItIs) {
  for (const int type : {VTK_HEXAHEDRON, VTK_TETRA}) {
    const Grid mesh = mesh_of(type, 24, towards_centre, fine_spot);
    const auto [grid, report] = sampled(*mesh, resolution(0.06));
    ASSERT_GE(grid.finer.size(), 1u);
    EXPECT_GT(report.sampled_peak, 0.97 * report.native_peak);
    for (std::size_t level = 2; level <= grid.finer.size(); ++level)  // In bricks of 8³ cells of the one before.
      for_each_voxel(level_of(grid, level), [&](const Vector3d& p, const Matrix3d&) {
        EXPECT_LT((p - Vector3d::Constant(0.5)).lpNorm<Eigen::Infinity>(), 0.36);
      });
  }
}

// With tensors at cells alone, these are compared at their centres.
TEST(MeshLevels, TensorsOfCellsAndTheWantedErrorCount) {
  const Grid mesh = unit_cube(VTK_HEXAHEDRON, 16, graded);
  add_cell_array<9>(*mesh, tensor_array, [&](vtkIdType i) {
    return flat(Matrix3d::Identity() * thin_layer(Vector3d(mesh->GetCell(i)->GetBounds()[0], 0, 0)));
  });
  std::size_t before = 0;
  for (const double error : {0.9, 0.1, 0.01, 0.0}) {
    SamplingSettings settings = resolution(1.0 / 16);
    settings.error = error;
    std::size_t voxels = 0;
    for (const LevelReport& level : sampled(*mesh, settings).report.finer) voxels += level.active;
    EXPECT_GE(voxels, before) << error;
    EXPECT_EQ(voxels > 0, error < 0.05) << error;
    before = voxels;
  }
}

TEST(MeshLevels, TheCoarsestAndTheFinestAreChosenOrGiven) {
  const Grid mesh = mesh_of(VTK_HEXAHEDRON, 16, graded, thin_layer);
  const auto chosen_voxel = [&](const SamplingSettings& settings = {}) {
    return sampled(*mesh, settings).report.voxel.x();
  };
  SamplingSettings single;
  single.levels = 1;
  EXPECT_GE(chosen_voxel(), chosen_voxel(single));  // Half of the volume's cells.
  SamplingSettings finest = resolution(1.0 / 16);
  finest.finest = 1.0 / 32;
  EXPECT_EQ(sampled(*mesh, finest).grid.finer.size(), 1u);
  finest.resolution = {};
  const double halvings = std::log2(chosen_voxel(finest) * 32);
  EXPECT_NEAR(halvings, std::round(halvings), 1e-9);
  const Grid even = mesh_of(VTK_HEXAHEDRON, 16, unchanged, thin_layer);
  EXPECT_NEAR(sampled(*even).report.voxel.x(), 1.0 / 16, 1e-9);
}

TEST(MeshLevels, RoundingIsOfTheMedianAndDoublesWithEachLevel) {
  const Grid mesh = mesh_of(VTK_HEXAHEDRON, 16, graded, thin_layer);
  SamplingSettings settings = resolution(1.0 / 16);
  const Sampled exact = sampled(*mesh, settings);
  settings.rounding = 0.1;
  const Sampled rounded = sampled(*mesh, settings);
  ASSERT_FALSE(rounded.grid.finer.empty());
  const auto quantum =
      static_cast<float>(std::exp2(std::floor(std::log2(settings.rounding * exact.report.native_median))));
  for (std::size_t level = 0; level <= rounded.grid.finer.size(); ++level) {
    const TensorGrid before = level_of(exact.grid, level), after = level_of(rounded.grid, level);
    ASSERT_EQ(before.blocks.size(), after.blocks.size());
    const float step = std::ldexp(quantum, static_cast<int>(level));
    for (std::size_t i = 0; i < after.blocks.size(); ++i)
      for (std::size_t k = 0; k < TensorBlock::voxels; ++k) {
        const float value = after.blocks[i].values[k](0, 0);
        ASSERT_EQ(value, step * std::round(value / step));
        ASSERT_LE(std::abs(value - before.blocks[i].values[k](0, 0)), 0.5001f * step);
      }
  }
}

TEST(MeshLevels, AreTheSameOnAnyNumberOfThreads) {
  const Grid mesh = mesh_of(VTK_TETRA, 10, graded, thin_layer);
  ASSERT_FALSE(sampled(*mesh, resolution(0.1)).grid.finer.empty());
  expect_same_on_threads(*mesh, resolution(0.1));
}

}  // namespace
}  // namespace tensorray
