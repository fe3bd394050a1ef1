#include "renderer/camera/camera.h"

#include "base/constants.h"
#include "base/geometry/box.h"
#include "renderer/camera/pixel_filter.h"
#include "renderer/sampling/random.h"
#include "tests/names.h"

namespace tensorray {
namespace {

/// Of each kind, without a lens.
std::vector<Camera> cameras() {
  return {perspective_camera({1, -5, 3}, {0.5, 1, 0}, {0, 0, 1}, 40, {640, 480}),
          orthographic_camera({-4, -3, -2}, {1, 1, 1}, {0, 1, 0.2}, 3, {300, 500})};
}

TEST(Camera, LooksAtItsTarget) {
  const Vector3d position(1, -5, 3), target(0.5, 1, 0);
  for (const Camera& camera : {perspective_camera(position, target, Vector3d::UnitZ(), 40, {640, 480}),
                               orthographic_camera(position, target, Vector3d::UnitZ(), 2, {640, 480})}) {
    const CameraRay ray = camera_ray(camera, {320, 240}, Vector2d::Zero());
    EXPECT_LT((ray.origin - position).norm(), 1e-14);
    EXPECT_LT((ray.direction - (target - position).normalized()).norm(), 1e-14);
    EXPECT_LT((camera.up.cross(camera.right) - camera.forward).norm(), 1e-14);
    EXPECT_NEAR(camera.right.z(), 0, 1e-14);
    EXPECT_GT(camera.up.z(), 0);
    EXPECT_NEAR(camera.focus_distance, (target - position).norm(), 1e-14);
    // Pixel coordinates increase to the right and downwards.
    EXPECT_GT(to_pixel(camera, target + 0.1 * camera.right)->x(), 320);
    EXPECT_LT(to_pixel(camera, target + 0.1 * camera.up)->y(), 240);
  }
}

TEST(Camera, SeesTheNamedAngleOrHeight) {
  const Camera wide = perspective_camera({0, 0, 0}, {0, 1, 0}, Vector3d::UnitZ(), 50, {200, 100});
  const Vector3d top = camera_ray(wide, {100, 0}, Vector2d::Zero()).direction;
  const Vector3d bottom = camera_ray(wide, {100, 100}, Vector2d::Zero()).direction;
  EXPECT_NEAR(std::acos(top.dot(bottom)), 50 * pi / 180, 1e-14);
  EXPECT_GT(top.z(), 0);
  const Camera flat = orthographic_camera({0, 0, 0}, {0, 1, 0}, Vector3d::UnitZ(), 3, {200, 100});
  EXPECT_LT((camera_ray(flat, {0, 0}, Vector2d::Zero()).origin - Vector3d(-3, 0, 1.5)).norm(), 1e-14);
}

TEST(Camera, ToPixelUndoesTheRay) {
  for (const Camera& camera : cameras()) {
    for (int i = 0; i < 100; ++i) {
      const Vector2d part(random_uniform(1, i, 0), random_uniform(1, i, 1));
      const Vector2d pixel = part.cwiseProduct(camera.resolution.cast<double>());
      const CameraRay ray = camera_ray(camera, pixel, Vector2d::Zero());
      EXPECT_NEAR(ray.direction.norm(), 1, 1e-14);
      EXPECT_LT((*to_pixel(camera, ray.origin + 7 * ray.direction) - pixel).norm(), 1e-10);
    }
    EXPECT_EQ(to_pixel(camera, camera.position - camera.forward).has_value(),
              camera.projection == Projection::orthographic);
  }
}

TEST(Camera, TheLensIsSharpInThePlaneOfFocus) {
  for (const double radius : {0.0, 0.2})
    for (Camera camera : cameras()) {
      camera.lens_radius = radius;
      const Vector2d pixel(77, 201);
      const auto in_plane = [&](const Vector2d& lens, double distance) -> Vector3d {
        const CameraRay ray = camera_ray(camera, pixel, lens);
        const double depth = distance - (ray.origin - camera.position).dot(camera.forward);
        return ray.origin + depth / ray.direction.dot(camera.forward) * ray.direction;
      };
      const double focus = camera.focus_distance;
      const Vector3d sharp = in_plane({0, 0}, focus);
      EXPECT_LT((*to_pixel(camera, sharp) - pixel).norm(), 1e-10);
      for (const Vector2d& lens : {Vector2d(1, 0), Vector2d(-0.6, 0.8), Vector2d(0.1, -0.4)}) {
        EXPECT_LT((in_plane(lens, focus) - sharp).norm(), 1e-12);
        // At twice the focus distance the circle of confusion is as large as the lens.
        const double blur = (in_plane(lens, 2 * focus) - in_plane({0, 0}, 2 * focus)).norm();
        EXPECT_NEAR(blur, radius * lens.norm(), 1e-12);
      }
    }
}

/// The extent of a box in the picture, from 0 to 1 along both axes of the picture.
Eigen::AlignedBox2d extent_in_picture(const Camera& camera, const AlignedBox3d& box) {
  Eigen::AlignedBox2d extent;
  for (const Vector3d& corner : corners_of(box)) {
    const auto pixel = to_pixel(camera, corner);
    EXPECT_TRUE(pixel.has_value());
    extent.extend(pixel.value_or(Vector2d(NAN, NAN)).cwiseQuotient(camera.resolution.cast<double>()));
  }
  return extent;
}

TEST(Framing, ShowsTheWholeBoxAsLargeAsItCanBe) {
  for (int i = 0; i < 500; ++i) {
    const auto random = [i](int dimension) { return random_uniform(2, i, dimension); };
    const double scale = std::pow(10, 12 * random(0) - 6);
    const Vector3d size(std::pow(10, 3 * random(1) - 3), std::pow(10, 3 * random(2) - 3), 1);
    const Vector3d corner = 10 * Vector3d(random(3) - 0.5, random(4) - 0.5, random(5) - 0.5);
    const AlignedBox3d box(scale * corner, scale * (corner + size));
    Framing framing;
    if (i % 2) framing.projection = Projection::orthographic;
    if (i % 5) framing.direction = Vector3d(random(6) - 0.5, random(7) - 0.5, random(8) - 0.5);
    framing.angle = 1 + 120 * random(9);
    framing.margin = 0.3 * random(10);
    framing.resolution = {1 + static_cast<int>(2000 * random(11)), 1 + static_cast<int>(2000 * random(12))};

    const Camera camera = frame_points(corners_of(box), framing);
    const Eigen::AlignedBox2d extent = extent_in_picture(camera, box);
    EXPECT_GE(extent.min().minCoeff(), framing.margin - 1e-9) << i;
    EXPECT_LE(extent.max().maxCoeff(), 1 - framing.margin + 1e-9) << i;
    EXPECT_LT((extent.center() - Vector2d(0.5, 0.5)).norm(), 1e-6) << i;
    // In at least one direction there is no free space except the margin.
    EXPECT_NEAR(extent.sizes().maxCoeff(), 1 - 2 * framing.margin, 1e-6) << i;
    EXPECT_GT(camera.focus_distance, 0);
    EXPECT_EQ(camera.lens_radius, 0);
  }
}

TEST(Framing, ShowsWhatHasNoVolume) {
  for (const Projection projection : {Projection::perspective, Projection::orthographic})
    for (const Vector3d& size : {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 2, 3)})
      for (const Vector3d& direction : {Vector3d(-0.5, 0.7, -0.5), Vector3d(1, 0, 0), Vector3d(0, 0, -1)}) {
        Framing framing;
        framing.projection = projection;
        framing.direction = direction;
        const AlignedBox3d box(Vector3d(5, 6, 7), Vector3d(5, 6, 7) + size);
        const Camera camera = frame_points(corners_of(box), framing);
        const Eigen::AlignedBox2d extent = extent_in_picture(camera, box);
        EXPECT_GE(extent.min().minCoeff(), 0.05 - 1e-9);
        EXPECT_LE(extent.max().maxCoeff(), 0.95 + 1e-9);
        if (size.isZero()) {
          EXPECT_NEAR(pixel_size(camera, box.center()) * 512 * 0.9, 1, 1e-9);
        }
      }
}

constexpr double filter_radius = 1.5;  // Of the box, half a pixel.

/// One of the two factors of the filter at x, divided by its value at 0.
double profile(PixelFilterShape shape, double x) {
  const double cosine = std::cos(pi * x / filter_radius), edge = std::exp(-4.5);
  if (shape == PixelFilterShape::gaussian) return (std::exp(-2 * x * x) - edge) / (1 - edge);
  if (shape == PixelFilterShape::box) return std::abs(x) <= 0.5 ? 1 : 0;
  return 0.35875 + 0.48829 * cosine + 0.14128 * std::cos(2 * pi * x / filter_radius) +
         0.01168 * std::cos(3 * pi * x / filter_radius);
}

/// The midpoint rule; its error for these profiles is far below 1e-7.
double integrate(PixelFilterShape shape, double from, double to) {
  constexpr int steps = 4000;
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += profile(shape, from + (to - from) * (i + 0.5) / steps);
  return sum * (to - from) / steps;
}

TEST(PixelFilter, SamplesAreQuantilesOfTheShape) {
  for (const PixelFilterShape shape :
       {PixelFilterShape::box, PixelFilterShape::gaussian, PixelFilterShape::blackman_harris}) {
    SCOPED_TRACE(static_cast<int>(shape));
    const PixelFilter filter(shape);
    const double end = shape == PixelFilterShape::box ? 0.5 : filter_radius, whole = integrate(shape, -end, end);
    double last = -end;
    for (const double u : {0.0, 1e-9, 1e-4, 0.003, 0.1, 0.25, 0.4999, 0.5, 0.6, 0.77, 0.999, 1 - 1e-6, 1 - 0x1p-32}) {
      const Vector2d offset = filter.sample({u, 1 - u});
      EXPECT_NEAR(integrate(shape, -end, offset.x()) / whole, u, 1e-6);
      EXPECT_NEAR(offset.y(), -offset.x(), 1e-6);
      EXPECT_GE(offset.x(), last);
      EXPECT_LE(offset.x(), end);
      last = offset.x();
    }
  }
}

}  // namespace
}  // namespace tensorray
