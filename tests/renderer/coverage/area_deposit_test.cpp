#include "renderer/coverage/area_deposit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Corners = std::array<Vector2d, 3>;

constexpr int width = 13, height = 9;

std::vector<double> pixels_of(AreaDeposit& deposit, int plane = 0) {
  deposit.flush();
  std::vector<double> pixels(width * height);
  for (int y = 0; y < height; ++y)
    AreaDeposit::read_row({&deposit}, y, plane, &pixels[static_cast<std::size_t>(y) * width]);
  return pixels;
}

/// Adds a triangle that has no neighbours.
void add_triangle(AreaDeposit& deposit, const Vector2d& a, const Vector2d& b, const Vector2d& c, double power) {
  const double density = deposit.triangle(a, b, c, power);
  if (density == 0) return;
  deposit.add_edge(a, b, density);
  deposit.add_edge(b, c, density);
  deposit.add_edge(c, a, density);
}

double sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

double area(const std::vector<Vector2d>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

/// The part of a convex polygon where `sign` · coordinate >= `sign` · limit.
std::vector<Vector2d> clipped(const std::vector<Vector2d>& polygon, int axis, double sign, double limit) {
  std::vector<Vector2d> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double from = sign * (a[axis] - limit), to = sign * (b[axis] - limit);
    if (from >= 0) part.push_back(a);
    if ((from < 0) != (to < 0)) part.push_back(a + from / (from - to) * (b - a));
  }
  return part;
}

double area_in_pixel(const Corners& corners, int x, int y) {
  std::vector<Vector2d> part(corners.begin(), corners.end());
  part = clipped(part, 0, 1, x);
  part = clipped(part, 0, -1, x + 1);
  part = clipped(part, 1, 1, y);
  return area(clipped(part, 1, -1, y + 1));
}

Corners random_triangle(std::mt19937& engine, double size) {
  std::uniform_real_distribution<double> at(-4, 17), offset(-size, size);
  const Vector2d middle(at(engine), at(engine) - 3);
  Corners corners;
  for (Vector2d& corner : corners) corner = middle + Vector2d(offset(engine), offset(engine));
  return corners;
}

TEST(AreaDeposit, EachPixelGetsTheAreaThatItShares) {
  std::mt19937 engine(1);
  for (const double size : {0.2, 1.0, 4.0, 30.0})
    for (int i = 0; i < 300; ++i) {
      const Corners t = random_triangle(engine, size);
      const double all = area({t.begin(), t.end()});
      if (all < 1e-3) continue;
      AreaDeposit deposit(width, height);
      add_triangle(deposit, t[0], t[1], t[2], 0.5e-4);
      const std::vector<double> pixels = pixels_of(deposit);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          ASSERT_NEAR(pixels[static_cast<std::size_t>(y) * width + x], 0.5e-4 * area_in_pixel(t, x, y) / all, 1e-13)
              << "size " << size << ", triangle " << i << ", pixel " << x << " " << y;
    }
}

/// Rows are the same, bit for bit, if a deposit keeps only some of them, and if several deposits share the triangles.
TEST(AreaDeposit, PartsAddUpToTheWhole) {
  std::mt19937 engine(6);
  AreaDeposit whole(width, height), first(width, height), second(width, height), middle(width, height, 3, 6);
  for (int i = 0; i < 400; ++i) {
    const Corners t = random_triangle(engine, i % 5 == 0 ? 8 : 1);
    add_triangle(whole, t[0], t[1], t[2], 1e-5);
    add_triangle(middle, t[0], t[1], t[2], 1e-5);
    add_triangle(i % 3 == 0 ? first : second, t[0], t[1], t[2], 1e-5);
  }
  const std::vector<double> expected = pixels_of(whole);
  for (AreaDeposit* deposit : {&first, &second, &middle}) deposit->flush();
  std::vector<double> row(width);
  for (int y = 0; y < height; ++y) {
    const std::vector<double> wanted(expected.begin() + y * width, expected.begin() + (y + 1) * width);
    AreaDeposit::read_row({&first, &second}, y, 0, row.data());
    EXPECT_EQ(row, wanted) << y;
    if (y < 3 || y >= 6) continue;
    AreaDeposit::read_row({&middle}, y, 0, row.data());
    EXPECT_EQ(row, wanted) << y;
  }
}

/// Rounding takes points of long edges over the borders of the plate.
TEST(AreaDeposit, EdgesMayBeLong) {
  std::mt19937 engine(9);
  std::uniform_real_distribution<double> x(0, width), y(-1e6, 1e6);
  const auto corner = [&](int i) { return Vector2d(i % 3 == 0 ? 0 : i % 3 == 1 ? width : x(engine), y(engine)); };
  for (int i = 0; i < 3000; ++i) {
    const Corners t{corner(i), corner(i / 3), corner(i / 9)};
    AreaDeposit deposit(width, height);
    add_triangle(deposit, t[0], t[1], t[2], 1e-5);
    EXPECT_NEAR(sum(pixels_of(deposit)) / 1e-5, part_on_plate(t[0], t[1], t[2], {width, height}), 1e-7)
        << i;  // Units of 2^-48.
  }
}

TEST(AreaDeposit, NoPowerIsLostWhereTrianglesHaveNoArea) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> x(0, width), y(0, height), part(0, 1);
  for (const double thickness : {0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3})
    for (int i = 0; i < 300; ++i) {
      const Vector2d a(x(engine), y(engine)), b(x(engine), y(engine));
      const Vector2d across = Vector2d(b.y() - a.y(), a.x() - b.x()).normalized();
      Vector2d c = a + part(engine) * (b - a) + thickness * across;
      c = c.cwiseMax(0).cwiseMin(Vector2d(width, height));
      AreaDeposit deposit(width, height);
      add_triangle(deposit, a, b, c, 1);
      const std::vector<double> pixels = pixels_of(deposit);
      ASSERT_NEAR(sum(pixels), 1, 1e-6) << thickness;
      ASSERT_GT(*std::min_element(pixels.begin(), pixels.end()), -1e-6) << thickness;
    }
  AreaDeposit deposit(width, height);
  add_triangle(deposit, {2.5, 3.5}, {2.5, 3.5}, {2.5, 3.5}, 1);
  EXPECT_EQ(pixels_of(deposit)[3 * width + 2], 1);
}

/// The density along a triangle's longest side is that of the triangle, seen from the side.
TEST(AreaDeposit, LinesAreWhatThinTrianglesTendTo) {
  AreaDeposit line(width, height), thin(width, height);
  const Vector2d a(0.25, 4.5), b(12.5, 4.5), c(4, 4.5);
  add_triangle(line, a, b, c, 1e-3);
  add_triangle(thin, a, b, c + Vector2d(0, 1e-3), 1e-3);
  const std::vector<double> expected = pixels_of(thin), pixels = pixels_of(line);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_NEAR(pixels[i], expected[i], 0.02e-3);
}

}  // namespace
}  // namespace tensorray
