#include "scenes/outputs/body_outline.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/geometry/box.h"
#include "renderer/meshes/mesh.h"
#include "tests/renderer/shapes.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// 100 × 100 pixels of one unit, below everything; seen from above.
Plate outline_plate() {
  Plate plate;
  plate.center = {0, 0, -10};
  plate.size = {100, 100};
  plate.resolution = {100, 100};
  return plate;
}

TriangleMesh outline_box(const Vector3d& min, const Vector3d& max) {
  return box_mesh({min, max}, Eigen::Affine3d::Identity());
}

/// The length of the strokes between two points that are visible, and of those that are hidden.
Vector2d stroke_lengths(const std::vector<OutlineStroke>& strokes, const Vector2d& a, const Vector2d& b) {
  Vector2d sum(0, 0);
  const Vector2d along = (b - a).normalized();
  const auto is_on = [&](const Vector2d& p) {
    const Vector2d from = p - a;
    return (from - from.dot(along) * along).norm() < 1e-9 && from.dot(along) > -1e-9 &&
           from.dot(along) < (b - a).norm() + 1e-9;
  };
  for (const OutlineStroke& stroke : strokes)
    if (is_on(stroke.from) && is_on(stroke.to)) sum[stroke.is_hidden ? 1 : 0] += (stroke.to - stroke.from).norm();
  return sum;
}

double outline_length(const std::vector<OutlineStroke>& strokes) {
  double sum = 0;
  for (const OutlineStroke& stroke : strokes) sum += (stroke.to - stroke.from).norm();
  return sum;
}

/// A box of 20 × 10 × 8 in light that falls by one unit along x and two along y for each unit of height. Its corner
/// (x, y, z) is at the pixel (50 + x + z + 10, 50 − y − 2 (z + 10)).
TEST(BodyOutlineTest, ABoxHasItsTwelveEdgesAtKnownPixels) {
  const auto strokes = body_outline({outline_box({-10, -5, 0}, {10, 5, 8})}, outline_plate(), {1, 2, -1});
  const auto at = [](double x, double y, double z) { return Vector2d(50 + x + z + 10, 50 - y - 2 * (z + 10)); };
  // The viewer is above, and on the side of −x and −y.
  for (const double z : {0.0, 8.0})
    for (const double y : {-5.0, 5.0}) {
      const bool is_hidden = z == 0 && y == 5;
      const Vector2d found = stroke_lengths(strokes, at(-10, y, z), at(10, y, z));
      EXPECT_NEAR(found[is_hidden ? 1 : 0], 20, 1e-9) << y << " " << z;
      EXPECT_NEAR(found[is_hidden ? 0 : 1], 0, 1e-9) << y << " " << z;
    }
  for (const double x : {-10.0, 10.0})
    for (const double y : {-5.0, 5.0}) {
      const Vector2d found = stroke_lengths(strokes, at(x, y, 0), at(x, y, 8));
      EXPECT_NEAR(found[x > 0 && y > 0 ? 1 : 0], 8 * std::sqrt(5), 1e-9) << x << " " << y;
    }
  EXPECT_NEAR(outline_length(strokes), 4 * (20 + 10 + 8 * std::sqrt(5)), 1e-6);  // And no diagonals.
}

/// A box above another one hides a part of its edges. Seen straight from above, edges of the top and of the bottom lie
/// on each other.
TEST(BodyOutlineTest, ABodyHidesTheLinesBehindIt) {
  const auto strokes =
      body_outline({outline_box({-30, -30, -10}, {30, 30, -5}), outline_box({-40, -10, 0}, {0, 10, 5})},
                   outline_plate(), {0, 0, -1});
  const Vector2d left = stroke_lengths(strokes, {20, 20}, {20, 80});  // Edges of the lower box.
  EXPECT_NEAR(left[0], 2 * 40, 2);
  EXPECT_NEAR(left[1], 2 * 20, 2);
  EXPECT_NEAR(stroke_lengths(strokes, {10, 40}, {50, 40})[0], 2 * 40, 1e-9);
}

/// Two boxes that touch, whose inner faces lie on each other: as one. Each has vertices of its own.
TEST(BodyOutlineTest, ShellsThatTouchHaveNoLineBetweenThem) {
  TriangleMesh both = outline_box({-20, -5, 0}, {0, 5, 8});
  const TriangleMesh right = outline_box({0, -5, 0}, {20, 5, 8});
  for (auto triangle : right.triangles) {
    for (std::uint32_t& corner : triangle) corner += static_cast<std::uint32_t>(both.vertices.size());
    both.triangles.push_back(triangle);
  }
  both.vertices.insert(both.vertices.end(), right.vertices.begin(), right.vertices.end());
  const auto strokes = body_outline({both}, outline_plate(), {0, 0, -1});
  EXPECT_NEAR(stroke_lengths(strokes, {50, 45}, {50, 55})[0], 0, 1e-9);
  EXPECT_NEAR(stroke_lengths(strokes, {30, 45}, {30, 55})[0], 2 * 10, 1e-9);
  EXPECT_NEAR(stroke_lengths(strokes, {30, 45}, {70, 45})[0], 2 * 40, 1e-9);
}

/// A ball of fine triangles has its silhouette and no other line.
TEST(BodyOutlineTest, ABallIsACircle) {
  TriangleMesh ball = std::get<TriangleMesh>(sphere(60).shape);
  for (Vector3d& vertex : ball.vertices) vertex = 9 * vertex + Vector3d(5, 0, 0);
  const auto strokes = body_outline({ball}, outline_plate(), {0, 0, -1});
  EXPECT_NEAR(outline_length(strokes), 2 * pi * 9, 0.1);
  for (const OutlineStroke& stroke : strokes) EXPECT_NEAR((stroke.from - Vector2d(55, 50)).norm(), 9, 0.1);
}

}  // namespace
}  // namespace tensorray
