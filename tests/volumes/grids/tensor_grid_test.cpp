// Grids of which a half is stored, against the whole; voxels that are not finite; and the voxels along a line.

#include "volumes/grids/tensor_grid.h"

#include <random>
#include <stdexcept>

#include "tests/volumes/level_support.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/grids/mirror.h"
#include "volumes/grids/voxel_walk.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

/// A field that is its own mirror image across an axis, of world positions.
Matrix3d symmetric_field(const Vector3d& at, int axis) {
  const auto one = [](const Vector3d& p) {
    return Matrix3d(Matrix3d::NullaryExpr([&](Eigen::Index i, Eigen::Index j) {
      return std::sin(0.3 * p.x() + double(i)) + 0.1 * p.y() * double(j + 1) - 0.05 * p.z() * p.y() * double(i + j);
    }));
  };
  Vector3d signs = Vector3d::Ones();
  signs[axis] = -1;
  return one(at) + signs.asDiagonal() * one(signs.cwiseProduct(at)) * signs.asDiagonal();
}

/// Planes at voxels and half-way between; along each axis; the stored half on either side.
TEST(Mirror, GivesTheWholeFieldOnAllLevels) {
  for (const int axis : {0, 1, 2})
    for (const double shift : {0.0, 0.25})
      for (const int side : {1, -1}) {
        Affine3d to_world(Eigen::Scaling(0.5));
        to_world.translation()[axis] = shift;
        const Formula value = [&](const Vector3d& index) { return symmetric_field(to_world * index, axis); };
        AlignedBox3i whole(Vector3i::Constant(-8), Vector3i::Constant(7));
        whole.min()[axis] = -16;
        whole.max()[axis] = shift == 0 ? 16 : 15;
        AlignedBox3i half = whole;
        (side > 0 ? half.min() : half.max())[axis] = side < 0 && shift != 0 ? -1 : 0;
        // Levels of the half lie away from the plane: finer voxels have no plane in common with one between voxels.
        const auto refines = [&](const Vector3i& brick) { return brick[axis] == (side > 0 ? 0 : -1); };
        const auto refines_both = [&](const Vector3i& brick) { return brick[axis] == 0 || brick[axis] == -1; };
        const int levels = shift != 0 ? 1 : axis == 0 ? 3 : 2;
        TensorGrid stored = grid_of_levels(half, levels, refines, value, to_world);
        stored.metadata[mirror_key] = std::string(1, "xyz"[axis]);
        const TensorGrid all = grid_of_levels(whole, levels, refines_both, value, to_world);
        const TensorGrid got = to_grid(with_mirror_image(view_of(stored)));
        EXPECT_EQ(got.metadata.count(mirror_key), 0U);
        for (int level = 0; level < levels; ++level) {
          const TensorBlocks& a = *levels_of(got)[level];
          const TensorBlocks& b = *levels_of(all)[level];
          SCOPED_TRACE(testing::Message() << axis << shift << side << level);
          ASSERT_EQ(a.size(), b.size());
          for (std::size_t i = 0; i < a.size(); ++i) {
            ASSERT_EQ(a[i].origin, b[i].origin);
            ASSERT_TRUE(level > 0 || a[i].active == b[i].active) << a[i].origin.transpose();
            for (std::size_t k = 0; k < TensorBlock::voxels; ++k)
              ASSERT_TRUE(!a[i].active[k] || (a[i].values[k] - b[i].values[k]).norm() < 1e-5);
          }
        }
        // The image of a refined brick has no voxels on its first face: they change nothing in the field.
        const Interpolant extending{Interpolation::cubic, Border::extend};
        const TensorField field(got, extending), expected(all, extending);
        TensorSampler sampler(field), of_expected(expected);
        std::mt19937 random(1);
        for (int i = 0; i < 1000; ++i) {
          const Vector3d at = to_world * random_point(random, whole.cast<double>());
          ASSERT_LT((sampler.at(at) - of_expected.at(at)).norm(), 1e-5) << at.transpose();
        }
      }
}

TensorGrid cube_of_identities() {
  return unit_voxels({0, 0, 0}, {7, 7, 7}, [](const Vector3i&) { return Matrix3d::Identity(); });
}

TEST(Mirror, RefusesPlanesThatVoxelsDoNotFit) {
  TensorGrid grid = cube_of_identities();
  for (const double shift : {0.1, 0.25}) {
    grid.to_world.translation().y() = shift;
    grid.metadata[mirror_key] = "y";
    EXPECT_THROW(with_mirror_image(view_of(grid)), std::invalid_argument);
  }
  grid.metadata[mirror_key] = "w";
  EXPECT_THROW(with_mirror_image(view_of(grid)), std::invalid_argument);
}

/// A pyramid without its base is closed by its image.
TEST(Mirror, ClosesTheSurface) {
  TensorGrid grid = cube_of_identities();
  grid.metadata[mirror_key] = "z";
  grid.surface = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  const TriangleMesh whole = with_mirror_image(view_of(grid)).surface;
  EXPECT_EQ(whole.triangles.size(), 6U);
  EXPECT_EQ(open_edges(whole), 0U);
  EXPECT_NEAR(whole.volume(), 2 * grid.surface.volume(), 1e-12);
}

TEST(TensorGrid, NonFiniteVoxelsAreRemovedAndCounted) {
  TensorGrid grid = unit_voxels({0, 0, 0}, {9, 0, 0}, [](const Vector3i& i) {
    return Matrix3d::Constant(i.x() == 3 ? NAN : i.x() >= 8 ? INFINITY : 1).eval();
  });
  EXPECT_EQ(remove_non_finite(grid), 3u);
  EXPECT_EQ(grid.active_voxels(), 7u);
  EXPECT_EQ(grid.blocks.size(), 1u);  // The second block has no active voxel left.
  EXPECT_EQ(remove_non_finite(grid), 0u);
}

struct Part {
  Vector3i voxel;
  double from, to;
};

std::vector<Part> walk(const Vector3d& a, const Vector3d& b, const AlignedBox3d& bounds) {
  std::vector<Part> parts;
  walk_voxels(a, b, bounds, [&](const Vector3i& voxel, double from, double to) { parts.push_back({voxel, from, to}); });
  return parts;
}

const AlignedBox3d bounds(Vector3d(-3, 2, 0), Vector3d(9, 11, 7));

TEST(VoxelWalk, PartsAdjoinLieInTheirVoxelsAndAreAllThatIsInTheBounds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> position(-6, 14);
  std::uniform_int_distribution<int> half(-12, 28);
  for (int i = 0; i < 20000; ++i) {
    Vector3d a(position(random), position(random), position(random));
    Vector3d b(position(random), position(random), position(random));
    if (i % 3 == 0)  // On voxels' faces, edges and corners.
      for (int axis = 0; axis < 3; ++axis) {
        a[axis] = half(random) / 2.0;
        b[axis] = half(random) / 2.0;
      }
    if (i % 5 == 0) b[i % 3] = a[i % 3];
    const std::vector<Part> parts = walk(a, b, bounds);
    // The reference: the fraction of 1000 points that is in the bounds.
    int within = 0;
    for (int k = 0; k < 1000; ++k) within += bounds.contains(Vector3d(a + (k + 0.5) / 1000 * (b - a)));
    double sum = 0;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const auto& [voxel, from, to] = parts[k];
      ASSERT_LT(from, to);
      if (k > 0) {
        ASSERT_EQ(from, parts[k - 1].to);
      }
      sum += to - from;
      const Vector3d middle = a + (from + to) / 2 * (b - a);
      ASSERT_LT((middle - voxel.cast<double>()).cwiseAbs().maxCoeff(), 0.5 + 1e-9);
      ASSERT_TRUE(bounds.contains(voxel.cast<double>()));
    }
    ASSERT_NEAR(sum, within / 1000.0, 2.1e-3);
  }
}

/// A point, and a line across the only voxel of an axis.
TEST(VoxelWalk, MayBeOfOneVoxel) {
  const std::vector<Part> point = walk({0.7, 4, 3}, {0.7, 4, 3}, bounds);
  const std::vector<Part> across = walk({2, 2, 9}, {2, 2, 1}, {Vector3d(0, 0, 4.5), Vector3d(8, 8, 5.5)});
  ASSERT_TRUE(point.size() == 1 && across.size() == 1);
  EXPECT_EQ(point[0].voxel, Vector3i(1, 4, 3));
  EXPECT_EQ(point[0].from, 0);
  EXPECT_EQ(point[0].to, 1);
  EXPECT_EQ(across[0].voxel, Vector3i(2, 2, 5));
  EXPECT_EQ(8 * (across[0].to - across[0].from), 1);
}

}  // namespace
}  // namespace tensorray
