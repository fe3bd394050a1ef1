#include "volumes/bricks/brick_index.h"

#include <algorithm>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace tensorray {
namespace {

using Eigen::Vector3i;

/// Expects that each brick has its number and that the places around the bricks have none.
void expect_finds(const std::vector<Vector3i>& bricks) {
  const BrickIndex index(bricks);
  for (std::size_t i = 0; i < bricks.size(); ++i) ASSERT_EQ(index.find(bricks[i]), i) << bricks[i].transpose();
  for (const Vector3i& brick : bricks)
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        const Vector3i near = brick + step * Vector3i::Unit(axis);
        const auto there = std::find(bricks.begin(), bricks.end(), near);
        const auto expected = there == bricks.end() ? BrickIndex::missing : std::uint32_t(there - bricks.begin());
        ASSERT_EQ(index.find(near), expected) << near.transpose();
      }
}

/// The bricks of a box in random order, without a fraction of them.
std::vector<Vector3i> box_of_bricks(const Vector3i& first, const Vector3i& size, double taken) {
  std::mt19937 random(1);
  std::bernoulli_distribution leaves(taken);
  std::vector<Vector3i> bricks;
  for (int x = 0; x < size.x(); ++x)
    for (int y = 0; y < size.y(); ++y)
      for (int z = 0; z < size.z(); ++z)
        if (!leaves(random)) bricks.emplace_back(first + Vector3i(x, y, z));
  std::shuffle(bricks.begin(), bricks.end(), random);
  return bricks;
}

TEST(BrickIndex, FindsBricksOfBoxes) {
  expect_finds({Vector3i(0, 0, 0)});
  expect_finds({Vector3i(-1, -1, -1)});
  expect_finds(box_of_bricks({-3, -7, 2}, {5, 9, 4}, 0));
  expect_finds(box_of_bricks({-3, -7, 2}, {5, 9, 4}, 0.9));
  expect_finds(box_of_bricks({1 << 27, -(1 << 27), -2}, {3, 4, 5}, 0.5));
  expect_finds(box_of_bricks({0, 0, -30}, {1, 1, 60}, 0.3));
}

TEST(BrickIndex, FindsBricksFarApart) {
  constexpr int far = 1 << 28;
  std::vector<Vector3i> bricks{{far, far, far}, {-far, -far, -far}, {far, -far, 0}, {0, 0, 0}, {-1, 0, far}};
  expect_finds(bricks);
  for (const Vector3i& corner : {Vector3i(-far, far, 5), Vector3i(1000, -2000, 3000)})
    for (const Vector3i& brick : box_of_bricks(corner, {4, 4, 4}, 0.2)) bricks.push_back(brick);
  expect_finds(bricks);
}

TEST(BrickIndex, HasNothingAnywhereElse) {
  constexpr int least = std::numeric_limits<int>::min(), greatest = std::numeric_limits<int>::max();
  for (const BrickIndex& index :
       {BrickIndex(), BrickIndex({{0, 0, 0}, {1, 1, 1}}), BrickIndex({{0, 0, 0}, {999, 0, 0}})})
    for (const int x : {least, -2, 2, greatest})
      for (const int y : {least, -1, 0, greatest})
        for (const int z : {least, 0, 1, greatest}) EXPECT_EQ(index.find({x, y, z}), BrickIndex::missing);
}

}  // namespace
}  // namespace tensorray
