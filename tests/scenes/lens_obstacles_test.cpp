// Tests how the picture of a lens shows obstacles.

#include <cmath>

#include <gtest/gtest.h>

#include "base/geometry/triangle_mesh.h"
#include "integrators/lens/lens.h"
#include "renderer/meshes/mesh.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr int pixels = 16;  // Pixels of 1/16.

Plate plate_at(double z) {
  Plate plate;
  plate.center = {0, 0, z};
  plate.size = {1, 1};
  plate.resolution = {pixels, pixels};
  return plate;
}

TriangleMesh box(const Vector3d& low, const Vector3d& high) {
  return box_mesh(Eigen::AlignedBox3d(low, high), Eigen::Affine3d::Identity());
}

/// Draws obstacles where light goes along +z from an image to a receiver at z = 2.
void draw(std::vector<TriangleMesh> obstacles, double image_z, int samples, Image& image) {
  Surfaces surfaces;
  surfaces.bounds = box({-1, -1, -1}, {1, 1, 1});
  surfaces.obstacles = std::move(obstacles);
  draw_obstacles(surfaces, {plate_at(2), {nullptr, plate_at(image_z)}, Vector3d::UnitZ()}, samples, image);
}

TEST(LensObstacles, CoverTheirPartOfEachPixelWhereThePictureIsTransparent) {
  const double pixel = 1.0 / pixels;  // The box covers pixels 4 to 11 along x, and a half of pixel 12.
  Image image(pixels, pixels, {"R", "G", "B", "A", "length"});
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) image.pixel(x, y)[3] = static_cast<float>(y % 2) / 2;
  const Image before = image;
  draw({box({-4 * pixel, -2 * pixel, 0}, {4.5 * pixel, 3 * pixel, 0.5})}, -2, 4, image);
  const float grey = image.pixel(6, 6)[0];
  EXPECT_GT(grey, 0.2f);
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) {
      const float covered = y < 5 || y >= 10 || x < 4 || x > 12 ? 0.0f : x == 12 ? 0.5f : 1.0f;
      const float open = 1 - before.pixel(x, y)[3];
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(x, y)[c], open * covered * grey, 1e-6) << x << " " << y;
      EXPECT_NEAR(image.pixel(x, y)[3], 1 - open * (1 - covered), 1e-6) << x << " " << y;
      EXPECT_EQ(image.pixel(x, y)[4], 0);
    }
}

TEST(LensObstacles, BehindTheImageTheyAreNotSeen) {
  Image image(pixels, pixels, {"R", "G", "B", "A"});
  const TriangleMesh obstacle = box({-0.5, -0.5, -0.5}, {0.5, 0.5, -0.25});
  draw({obstacle}, 0, 1, image);
  for (const float value : image.pixels) EXPECT_EQ(value, 0);
  draw({obstacle}, -2, 1, image);
  EXPECT_EQ(image.pixel(8, 8)[3], 1);
}

}  // namespace
}  // namespace tensorray
