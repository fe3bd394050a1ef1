#include <cmath>

#include <gtest/gtest.h>

#include "base/geometry/box.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

TEST(TurnBetween, IsTheSmallestRotationOfOneDirectionToTheOther) {
  const Vector3d directions[] = {{1, 0, 0},  {-1, 0, 0},  {0, 0, 2},   {0, 1e-9, -1},
                                 {3, -4, 5}, {-3, 4, -5}, {1, 1e-7, 0}};
  for (const Vector3d& from : directions)
    for (const Vector3d& to : directions) {
      const Eigen::Quaterniond turn = turn_between(from, to);
      EXPECT_NEAR(turn.norm(), 1, 1e-9);
      EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-6) << from << "\n" << to;
      const double angle = std::atan2(from.cross(to).norm(), from.dot(to));
      EXPECT_NEAR(2 * std::atan2(turn.vec().norm(), turn.w()), angle, 1e-6) << from << "\n" << to;
    }
}

}  // namespace
}  // namespace tensorray
