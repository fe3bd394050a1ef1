// Compares the stretch of bundles of light with closed forms and with neighbouring rays.

#include "integrators/stretch/stretch.h"

#include "base/constants.h"
#include "tests/tracing/support.h"
#include "tracing/trace/trace.h"

namespace tensorray {
namespace {

StretchSettings along_minus_z(double length, double flexibility = 1) {
  StretchSettings settings;
  settings.flexibility = flexibility;
  settings.length = length;
  return settings;
}

/// The stretch of one start.
double stretch_at(const TensorField& field, const StretchSettings& settings, const Vector3d& start, double step = 0.125,
                  Surfaces extra = {}) {
  extra.bounds = surfaces_of(field).bounds;
  return stretches(field, Geometry(std::move(extra)), settings_of(BendingMethod::splitting, step), settings,
                   {start})[0];
}

/// T_xz = −6 x: light along −z obeys x'' = 6 s x near x = 0, so that a distance grows as cosh(√(6 s) L). A distance
/// along y does not change.
Matrix3d diverging(const Vector3d& p) { return Vector3d(-6 * p.x(), 0, 0) * Vector3d::UnitZ().transpose(); }

TEST(Stretch, OfADivergingFieldIsThatOfTheHyperbolicCosine) {
  const TensorField field = cube_field(17, diverging);
  for (const double length : {0.3, 0.9, 1.6}) {
    const double expected = std::log(std::cosh(std::sqrt(0.5 * 6) * length)) / length;
    // The relative error of splitting is a fraction of (√3 h)²/12, h = 1/64.
    EXPECT_NEAR(stretch_at(field, along_minus_z(length, 0.5), {0, 0.2, 0.9}), expected, 2e-4 * expected) << length;
  }
}

/// Behind the volume, distances grow with the difference of directions: cosh k d + k (L − d) sinh k d.
TEST(Stretch, GoesOnBehindTheVolume) {
  const TensorField field = cube_field(17, diverging);
  const double k = std::sqrt(0.5 * 6), depth = 2, length = 5;
  // From the face where light enters, and from half a unit before it.
  for (const double before : {0.0, 0.5}) {
    const double behind = length - depth - before;
    const double expected = std::log(std::cosh(k * depth) + k * behind * std::sinh(k * depth)) / length;
    EXPECT_NEAR(stretch_at(field, along_minus_z(length, 0.5), {0, 0.2, 1 + before}), expected, 2e-4 * expected);
  }
}

/// The stretch is the greatest distance that a circle of neighbours reaches at equal lengths. Many rays leave at a
/// slant, through another face than the one through which they entered.
TEST(Stretch, IsThatOfNeighbouringRaysAtEqualLengths) {
  const TensorField field = cube_field(17, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  BendingSettings bending = settings_of(BendingMethod::rk4, 0.03125);
  StretchSettings settings = along_minus_z(0, 0.7);
  settings.direction = Vector3d(0.3, -0.2, -1).normalized();
  const Vector3d u = settings.direction.unitOrthogonal(), v = settings.direction.cross(u);
  constexpr double radius = 1e-5;
  for (const Vector3d& start : {Vector3d(0.1, 0.3, 0.2), Vector3d(-0.5, 0.4, 2), Vector3d(0.3, 0.3, 0.9)})
    for (const double length : {0.4, 1.3, 4.0}) {
      settings.length = bending.max_length = length;
      const auto end_of = [&](const Vector3d& from) {
        const Ray ray = trace_one(field, geometry, bending, from, settings.direction, settings.flexibility);
        EXPECT_EQ(ray.end, RayEnd::missed);
        return ray.position;
      };
      double greatest = 0;
      for (int i = 0; i < 64; ++i) {
        const double angle = i * pi / 64;
        const Vector3d offset = radius * (std::cos(angle) * u + std::sin(angle) * v);
        greatest = std::max(greatest, (end_of(start + offset) - end_of(start - offset)).norm() / (2 * radius));
      }
      if (start.z() == 2 && length < 1) continue;  // Not yet in the volume.
      const double value = stretches(field, geometry, bending, settings, {start})[0];
      // The greatest of 64 directions is too small by at most 1 − cos(π/128) = 3e-4.
      EXPECT_NEAR(value * length, std::log(greatest), 1e-3) << start.transpose() << ", " << length;
    }
}

TEST(Stretch, IsNoneWhereLightDoesNotComeSoFar) {
  const TensorField field = constant_field(Matrix3d::Zero());
  const Surfaces obstacle = obstacle_between({-0.3, -0.3, -0.3}, {0.3, 0.3, 0});
  EXPECT_TRUE(std::isnan(stretch_at(field, along_minus_z(1), {0, 0, 0.9}, 0.5, obstacle)));
  EXPECT_NEAR(stretch_at(field, along_minus_z(0.8), {0, 0, 0.9}, 0.5, obstacle), 0, 1e-7);
  EXPECT_TRUE(std::isnan(stretch_at(field, along_minus_z(0.8), {0, 0, -0.1}, 0.5, obstacle))) << "in the obstacle";
  EXPECT_TRUE(std::isnan(stretch_at(field, along_minus_z(9), {3, 0, 2}, 0.5))) << "beside the volume";
}

TEST(Stretch, GridIsALatticeInTheVolume) {
  const Vector3d center(3, 4, 5);
  const auto tensor = [&](const Vector3d& p) { return diverging(p - center); };
  const TensorField field(cube_grid({9, 17, 5}, tensor, Affine3d(Eigen::Translation3d(center))));
  const Geometry geometry(surfaces_of(field));
  const ScalarGrid grid = stretch_grid(field, geometry, {}, along_minus_z(0.5), 33, Progress());
  std::size_t voxels = 0;
  for (const ScalarBlock& block : grid.blocks) {
    voxels += block.active.count();
    for (const int offset : {0, 100, 511}) {
      if (!block.active[offset]) continue;
      const Vector3i voxel = block.origin + TensorBlock::position(offset);
      const Vector3d start = grid.to_world * voxel.cast<double>();
      EXPECT_EQ(block.values[offset], stretches(field, geometry, {}, along_minus_z(0.5), {start})[0]);
    }
  }
  EXPECT_EQ(voxels, 17u * 33u * 9u);
  EXPECT_NEAR((grid.to_world * Vector3d(16, 32, 8) - Vector3d(4, 5, 6)).norm(), 0, 1e-12);
  EXPECT_NEAR((grid.to_world * Vector3d(0, 0, 0) - Vector3d(2, 3, 4)).norm(), 0, 1e-12);
}

TEST(Stretch, PictureIsOfThePixelsMiddles) {
  const TensorField field = cube_field(9, linear_tensor);
  const Geometry geometry(surfaces_of(field));
  Plate pixels = plate_across({0, 0, -1}, -1.25);
  pixels.size = {3, 1.5};
  pixels.resolution = {12, 6};
  const std::vector<float> picture = stretch_picture(field, geometry, {}, along_minus_z(2), pixels, Progress());
  ASSERT_EQ(picture.size(), 72u);
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 12; ++x) {
      const Vector3d start = pixels.to_world({x + 0.5, y + 0.5});
      EXPECT_NEAR(start.z(), 1.25, 1e-12);
      const float value = picture[static_cast<std::size_t>(12 * y + x)];
      EXPECT_EQ(std::isnan(value), std::abs(start.x()) > 1);
      if (!std::isnan(value)) {
        EXPECT_EQ(value, stretches(field, geometry, {}, along_minus_z(2), {start})[0]);
      }
    }
}

TEST(Stretch, RefusesSettingsOutOfRangeAndStopsWhenCancelled) {
  const TensorField field = constant_field(Matrix3d::Zero());
  const Geometry geometry(surfaces_of(field));
  Progress progress;
  for (const double length : {0.0, -1.0, double{INFINITY}})
    EXPECT_THROW(stretch_grid(field, geometry, {}, along_minus_z(length), 9, progress), std::invalid_argument);
  EXPECT_THROW(stretch_grid(field, geometry, {}, along_minus_z(1), 1, progress), std::invalid_argument);
  progress.cancelled = true;
  EXPECT_THROW(stretch_grid(field, geometry, {}, along_minus_z(1), 9, progress), Cancelled);
}

}  // namespace
}  // namespace tensorray
