#include "volumes/grids/voxel_walk.h"

#include <random>

#include "tests/names.h"

namespace tensorray {
namespace {

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
