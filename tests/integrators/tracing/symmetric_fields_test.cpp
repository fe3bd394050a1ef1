// Tests that packets give the same bits in fields of symmetric tensors, whose voxels have five components, as if they
// had eight.

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "integrators/tracing/trace.h"
#include "tests/integrators/packet_support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

using SymmetricFields = EveryInstructionSet;
INSTANTIATE_TEST_SUITE_P(All, SymmetricFields, test::instruction_sets(), instruction_set_name);

/// A field as symmetric tensors and, with the same values, as tensors of any kind.
struct TwoFields {
  TensorField symmetric, general;
};

/// @param grid  Its tensors lose their antisymmetric parts, and its first voxel becomes zero. A −0 there makes the
/// second field general.
TwoFields two_fields(TensorGrid grid) {
  for (TensorBlock& block : grid.blocks)
    for (Eigen::Matrix3f& T : block.values) T.triangularView<Eigen::StrictlyUpper>() = T.transpose();
  TensorBlock& block = grid.blocks.front();
  int first = 0;
  while (!block.active[first]) ++first;
  block.values[first].setZero();
  TensorField symmetric(grid);
  block.values[first](0, 1) = -0.0f;
  return {std::move(symmetric), TensorField(grid)};
}

/// Whether two values are the same, bit for bit, or both are NaN.
bool same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)); }

bool same(const RayDifferential& a, const RayDifferential& b) {
  bool all = true;
  for (int i = 0; i < 6; ++i) all &= same(a.position(i), b.position(i)) && same(a.direction(i), b.direction(i));
  return all && same(a.length(0), b.length(0)) && same(a.length(1), b.length(1));
}

/// Traces the rays through both fields.
void expect_same_rays(const TwoFields& fields, const BendingSettings& settings, const RayBatch& rays) {
  ASSERT_TRUE(fields.symmetric.is_symmetric());
  ASSERT_FALSE(fields.general.is_symmetric());
  Surfaces surfaces;
  surfaces.bounds = box_mesh(fields.symmetric.index_bounds(), fields.symmetric.to_world());
  const Geometry geometry(std::move(surfaces));
  RayBatch one = rays, other = rays;
  trace(fields.symmetric, geometry, settings, one);
  trace(fields.general, geometry, settings, other);
  EXPECT_EQ(one.tensor_samples, other.tensor_samples);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    differ += !identical(one, i, other, i);
    if (rays.wants_log_radiance_scale) differ += !same(one.log_radiance_scale[i], other.log_radiance_scale[i]);
    if (!rays.differentials.empty()) differ += !same(one.differentials[i], other.differentials[i]);
  }
  EXPECT_EQ(differ, 0u);
}

RayBatch with_differentials(RayBatch rays) {
  for (const Vector3d& direction : rays.direction) {
    RayDifferential differential;
    differential.position.col(0) = direction.unitOrthogonal();
    differential.direction.col(1) = 0.3 * direction.unitOrthogonal();
    rays.differentials.push_back(differential);
  }
  return rays;
}

/// From zero to values for which no series converges.
const std::vector<double> flexibilities{1e-4, 0.3, -30, 0, 0.02, 5, 1e5, -0.1, 1e300, 0.002, 0.6};

TEST_P(SymmetricFields, BendRaysAsIfTheyWereGeneral) {
  for (const Lattice& lattice : tested_lattices())
    for (const BendingMethod method : {BendingMethod::splitting, BendingMethod::euler, BendingMethod::rk4,
                                       BendingMethod::bs23, BendingMethod::dopri5}) {
      SCOPED_TRACE(lattice.name + ", " + std::to_string(static_cast<int>(method)));
      const TensorGrid grid = lattice_grid(index_box({-13, 5, -30}, {37, 41, 50}), lattice, smooth_tensor(71));
      const TwoFields fields = two_fields(without_blocks(grid, 0.2, 72));
      BendingSettings settings = settings_of(method, 0);
      settings.max_steps = 200;
      RayBatch rays = random_rays(fields.symmetric, 16, flexibilities, 73);
      expect_same_rays(fields, settings, rays);
      rays.wants_log_radiance_scale = true;
      expect_same_rays(fields, settings, rays);
      rays = random_rays(fields.symmetric, 8, {0.3, -0.5, 1}, 74);
      expect_same_rays(fields, settings, with_differentials(std::move(rays)));
    }
}

TEST_P(SymmetricFields, EndRaysAsIfTheyWereGeneralWhereTensorsAreNotFinite) {
  TensorGrid grid = lattice_grid(index_box({0, 0, 0}, {30, 30, 30}), lattices()[0], smooth_tensor(75));
  Numbers numbers(76);
  for (TensorBlock& block : grid.blocks)
    for (Eigen::Matrix3f& T : block.values)
      if (numbers.next() < 0.002) T.setConstant(numbers.next() < 0.5 ? std::nanf("") : 1e38f);
  const TwoFields fields = two_fields(std::move(grid));
  const RayBatch rays = random_rays(fields.symmetric, 64, flexibilities, 77);
  for (const BendingMethod method : {BendingMethod::splitting, BendingMethod::dopri5}) {
    BendingSettings settings = settings_of(method, 0);
    settings.max_steps = 200;
    expect_same_rays(fields, settings, rays);
  }
}

/// Rays in two cells, whose vectors are loaded together with parts of other voxels.
TEST_P(SymmetricFields, DependOnNothingBeyondTheirCells) {
  const TensorFunction smooth = smooth_tensor(78);
  for (int z = 0; z < TensorBrick::cells; ++z) {
    const Vector3i cells[2] = {{3, 7, z}, {12, 0, TensorBrick::cells - 1 - z}};
    std::vector<RayBatch> ends;
    for (const float far : {0.0f, std::nanf(""), 1e30f}) {
      TensorGrid grid = lattice_grid(index_box({0, 0, 0}, {25, 25, 25}), lattices()[0], [&](const Vector3d& p) {
        const auto at_corner = [&](const Vector3i& cell) {
          const Eigen::Array3d from = (p - cell.cast<double>()).array();
          return (from >= 0).all() && (from <= 1).all();
        };
        const bool near = at_corner(cells[0]) || at_corner(cells[1]);
        return Matrix3d(near ? smooth(p) : Matrix3d::Constant(static_cast<double>(far)));
      });
      TensorField field = two_fields(std::move(grid)).symmetric;
      ASSERT_TRUE(field.is_symmetric());
      Surfaces surfaces;
      RayBatch rays;
      Numbers numbers(79);
      for (const Vector3i& cell : cells) {  // Middles of steps that leave the box stay within the cell.
        const Vector3d first = cell.cast<double>();
        surfaces.obstacles.push_back(
            box_mesh({Vector3d(first.array() + 0.3), Vector3d(first.array() + 0.7)}, lattices()[0].to_world));
      }
      for (int i = 0; i < 64; ++i) {
        const Vector3d first = cells[i / 3 % 2].cast<double>();
        add_bundle(rays, field, numbers.in({Vector3d(first.array() + 0.35), Vector3d(first.array() + 0.65)}),
                   numbers.direction(), {0.1, 0.3});
      }
      ends.push_back(traced(make_scene("", std::move(field), surfaces, 0.5, rays), rays));
    }
    for (std::size_t i = 0; i < ends[0].size(); ++i) {
      EXPECT_EQ(ends[0].end[i], RayEnd::obstacle);
      EXPECT_TRUE(identical(ends[1], i, ends[0], i)) << i;
      EXPECT_TRUE(identical(ends[2], i, ends[0], i)) << i;
    }
  }
}

}  // namespace
}  // namespace tensorray
