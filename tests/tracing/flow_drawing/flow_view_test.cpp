// Reading a flow map at the points of a picture.

#include "tracing/flow_drawing/flow_view.h"

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/tracing/flow_support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Affine2d;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector2i;

/// The map `landing` over the square of starts [-1, 1]², as a lattice of n × n quads.
template <class Map>
FlowMap lattice(const Map& landing, int n) {
  return lattice_map(n, -1, 1, landing);
}

/// All points of a picture, by row. `n` samples along each side of a pixel.
std::vector<FlowPoint> draw(const FlowMap& map, const FlowPicture& picture, int n = 1, const FlowRange& range = {},
                            double place = 0) {
  const FlowView view(map, picture, {range}, n);
  const Vector2i size = n * picture.resolution;
  std::vector<FlowPoint> all(static_cast<std::size_t>(size.prod())), points;
  for (int tile = 0; tile < view.tiles(); ++tile) {
    view.draw(tile, n, 0, place, {}, points);
    const Eigen::AlignedBox2i box = view.pixels(tile);
    const int columns = n * (box.sizes().x() + 1);
    for (int i = 0; i < static_cast<int>(points.size()); ++i)
      all[static_cast<std::size_t>((n * box.min().y() + i / columns) * size.x() + n * box.min().x() + i % columns)] =
          points[static_cast<std::size_t>(i)];
  }
  return all;
}

FlowPicture landings_of(int size) {
  FlowPicture picture;
  picture.resolution = {size, size};
  return picture;
}

/// From starts in [-1, 1]² to the pixels of a picture.
FlowPicture starts_of(int size) {
  FlowPicture picture = landings_of(size);
  picture.side = FlowSide::starts;
  picture.to_pixel.linear() *= size / 2.0;
  picture.to_pixel.translation() = Vector2d(size, size) / 2;
  return picture;
}

Vector2d middle(std::size_t i, int size) {
  const auto at = static_cast<int>(i);
  return {at % size + 0.5, at / size + 0.5};
}

/// A turn and a stretch: both triangles of a side cover its samples only once, also where corners lie on samples.
TEST(FlowView, LinearMapsAreExactAndCoverPointsOnce) {
  Affine2d turn = Affine2d::Identity();
  turn.linear() << 20, -12, 8, 24;
  turn.translation() = Vector2d(20, 20.5);
  for (const int n : {1, 4, 7})
    for (const int samples : {1, 2, 3}) {
      const std::vector<FlowPoint> seen =
          draw(lattice([&](const Vector2d& start) -> Vector2d { return turn * start; }, n), landings_of(40), samples);
      int covered = 0;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const Vector2d start = turn.inverse() * (middle(i, 40 * samples) / samples);
        if (seen[i].end != RayEnd::plate) {
          EXPECT_GT(start.cwiseAbs().maxCoeff(), 1 - 1e-6);
          continue;
        }
        ++covered;
        ASSERT_EQ(seen[i].sheets, 1) << i;
        EXPECT_LT((seen[i].other.cast<double>() - start).norm(), 1e-6);
        EXPECT_LT((seen[i].jacobian.cast<double>() - turn.linear()).norm(), 1e-4);
        EXPECT_NEAR(seen[i].length, start.x(), 1e-6);
      }
      EXPECT_GT(covered, 600 * samples * samples);
    }
}

/// Between corners the map is quadratic, so that halving quads divides the error within by eight.
TEST(FlowView, SmoothMapsAreOfThirdOrder) {
  const auto landing = [](const Vector2d& at) -> Vector2d {
    return {32 + 24 * at.x() + 4 * std::sin(2 * at.x() + at.y()), 32 + 24 * at.y() + 4 * std::cos(at.x() - at.y())};
  };
  for (const FlowSide side : {FlowSide::starts, FlowSide::landings}) {
    double errors[2];
    for (const int level : {0, 1}) {
      const FlowPicture picture = side == FlowSide::starts ? starts_of(64) : landings_of(64);
      const std::vector<FlowPoint> seen = draw(lattice(landing, 16 << level), picture);
      double& error = errors[level] = 0;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const Vector2d at = middle(i, 64);
        if (seen[i].end != RayEnd::plate || (at.array() - 32).abs().maxCoeff() > 12) continue;  // Away from the rim.
        const Vector2d other = seen[i].other.cast<double>();
        error = std::max(error, side == FlowSide::starts ? (landing(picture.to_pixel.inverse() * at) - other).norm()
                                                         : (landing(other) - at).norm());
      }
      EXPECT_GT(error, 0);
    }
    EXPECT_LT(errors[0], 0.02);
    EXPECT_GT(errors[0] / errors[1], 6);
  }
}

/// A strip folded at x = 0: two sheets to the right of it, none to the left. The one nearer to straight light is seen.
TEST(FlowView, ShowsTheNearestOfItsSheets) {
  const auto fold = [](const Vector2d& at) -> Vector2d { return {8 + 24 * std::abs(at.x()), 20 + 18 * at.y()}; };
  FlowPicture picture = landings_of(40);
  picture.straight.linear().setZero();
  picture.straight.translation() = Vector2d(0.5, 0);
  const std::vector<FlowPoint> seen = draw(lattice(fold, 10), picture);
  int twofold = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Vector2d at = middle(i, 40);
    const bool covered = at.x() > 8 && at.x() < 32 && std::abs(at.y() - 20) < 18;
    ASSERT_EQ(seen[i].sheets, covered ? 2 : 0) << at.transpose();
    if (!covered) continue;
    ++twofold;
    const double start = (at.x() - 8) / 24;  // Quads of 0.2; those at the fold have the mean of two slopes there.
    EXPECT_NEAR(seen[i].other.x(), start, start < 0.2 ? 0.05 : 1e-5);
  }
  EXPECT_EQ(twofold, 24 * 36);
}

/// A view of a range draws each of its wavelengths as a view of this wavelength alone does.
TEST(FlowView, DrawsAnyWavelengthOfARange) {
  FlowMap map = lattice([](const Vector2d& at) -> Vector2d { return Vector2d(30, 40) + 20 * at; }, 8);
  constexpr std::size_t samples = 5;
  FlowMap range = map;
  range.wavelengths = samples;
  range.check_step = samples - 1;
  range.landings.clear();
  range.ends.clear();
  range.lengths.assign(map.starts.size() * 2, 3.0f);
  for (std::size_t i = 0; i < map.starts.size(); ++i)
    for (std::size_t sample = 0; sample < samples; ++sample) {
      const auto way = static_cast<float>(sample * sample);  // Light turns back in y.
      range.landings.emplace_back(map.landings[i] + Eigen::Vector2f(4 * way, 8 * std::abs(way - 6)));
      range.ends.push_back((i + sample) % 13 == 0 ? RayEnd::missed : RayEnd::plate);
    }
  for (std::size_t t = 0; t < range.triangles.size(); t += 7) range.triangles[t].is_torn = true;
  for (const double place : {0.75, 1.0, 1.4, 1.5, 2.0, 2.2, 3.5}) {
    const std::vector<FlowPoint> one = draw(range, landings_of(96), 2, {place, place}, place),
                                 seen = draw(range, landings_of(96), 2, {0.75, 3.5}, place);
    ASSERT_EQ(one.size(), seen.size());
    std::size_t covered = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
      ASSERT_EQ(one[i].sheets, seen[i].sheets) << place;
      ASSERT_EQ(one[i].other, seen[i].other) << place;
      covered += one[i].sheets > 0;
    }
    EXPECT_GT(covered, 1000u) << place;
  }
}

TEST(FlowView, TearsAndShadowsAreHolesOrUnknown) {
  FlowMap map = lattice([](const Vector2d& at) -> Vector2d { return Vector2d(20, 20) + 20 * at; }, 4);
  map.triangles[0].is_torn = true;
  map.ends[24] = RayEnd::obstacle;  // A corner: its triangles are partly in shadow.
  for (const std::size_t i : {3, 4, 8, 9}) map.ends[i] = RayEnd::missed;  // A whole quad.
  const std::vector<FlowPoint> landed = draw(map, landings_of(40)), started = draw(map, starts_of(40));
  const auto at = [](const std::vector<FlowPoint>& points, int x, int y) {
    return points[static_cast<std::size_t>(y * 40 + x)];
  };
  EXPECT_EQ(at(landed, 6, 2).sheets, 0);  // Torn.
  EXPECT_TRUE(at(started, 6, 2).is_unknown);
  EXPECT_EQ(at(landed, 38, 37).sheets, 0);  // Partly in shadow.
  EXPECT_TRUE(at(started, 38, 37).is_unknown);
  EXPECT_EQ(at(landed, 36, 3).sheets, 0);
  EXPECT_EQ(at(started, 36, 3).end, RayEnd::missed);
  EXPECT_FALSE(at(started, 36, 3).is_unknown);
  EXPECT_EQ(at(landed, 12, 12).sheets, 1);
  EXPECT_FALSE(at(started, 12, 12).is_unknown);
}

}  // namespace
}  // namespace tensorray
