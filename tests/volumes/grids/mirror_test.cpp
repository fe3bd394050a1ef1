// Fields of which a half is stored, against the whole.
#include "volumes/grids/mirror.h"

#include <stdexcept>

#include "tests/volumes/level_support.h"
#include "volumes/bricks/tensor_field.h"
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

}  // namespace
}  // namespace tensorray
