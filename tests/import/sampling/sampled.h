#pragma once
/// What sampling makes of a mesh.

#include <tbb/global_control.h>

#include "base/process/progress.h"
#include "tests/import/mesh_fixtures.h"
#include "tools/import/meshes/mesh_tensors.h"
#include "tools/import/sampling/mesh_sampling.h"

namespace tensorray::mesh_fixtures {

inline constexpr int families[] = {VTK_HEXAHEDRON,      VTK_LAGRANGE_HEXAHEDRON, VTK_WEDGE, VTK_PYRAMID, VTK_TETRA,
                                   VTK_QUADRATIC_TETRA, VTK_QUADRATIC_HEXAHEDRON};

/// The mesh with tensors at its points.
template <class Mesh>
Mesh with_field(const Mesh& mesh, const std::function<Matrix3d(const Vector3d&)>& value = linear_tensor) {
  add_array<9>(*mesh, tensor_array, [&](const Vector3d& p) { return flat(value(p)); });
  return mesh;
}

/// Of a number of voxels along the longest edge or along each, or of their size.
template <class Resolution>
SamplingSettings resolution(const Resolution& value) {
  SamplingSettings settings;
  settings.resolution = value;
  return settings;
}

/// A level of a grid as a grid of its own.
inline TensorGrid level_of(const TensorGrid& grid, std::size_t level) {
  TensorGrid result;
  result.blocks = level == 0 ? grid.blocks : grid.finer[level - 1];
  result.to_world = grid.to_world * Eigen::Scaling(std::pow(0.5, level));
  return result;
}

struct Sampled {
  TensorGrid grid;
  SamplingReport report;
};

inline Sampled sampled(vtkDataSet& mesh, const SamplingSettings& settings = {}) {
  Sampled result;
  result.grid = sample_mesh(mesh, settings, Progress(), result.report);
  EXPECT_EQ(result.grid.finer.size(), result.report.finer.size());
  return result;
}

/// Expects that a mesh is sampled to the same bits by any number of threads.
inline void expect_same_on_threads(vtkDataSet& mesh, const SamplingSettings& settings) {
  std::vector<TensorGrid> grids;
  for (const std::size_t threads : {1u, 2u, 3u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    grids.push_back(sampled(mesh, settings).grid);
    ASSERT_EQ(grids.back().finer.size(), grids.front().finer.size());
    for (std::size_t level = 0; level <= grids.back().finer.size(); ++level)
      expect_same_blocks(level_of(grids.back(), level), level_of(grids.front(), level));
  }
}

}  // namespace tensorray::mesh_fixtures
