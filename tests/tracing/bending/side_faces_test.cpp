#include <vector>

#include <gtest/gtest.h>

#include "tests/tracing/support.h"
#include "tracing/bending/bending.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// The end of a ray that goes straight through the cube [-1, 1]³ and is found at `position` behind it.
RayEnd end_at(const Vector3d& light, const Vector3d& position, const Vector3d& direction, RayEnd end = RayEnd::plate) {
  const TensorField field = test::constant_field(Eigen::Matrix3d::Identity());
  RayBatch batch;
  batch.add(position, direction.normalized(), 0);
  batch.end = {end};
  SideFaces(field, light).mark(batch);
  return batch.end[0];
}

/// A ray leaves the cube through the face in the direction `out` from its middle.
RayEnd end_through(const Vector3d& light, const Vector3d& out) { return end_at(light, 5 * out, out); }

TEST(SideFacesTest, AreThoseAcrossTheLight) {
  for (const double tilt : {0.0, 0.3, -0.9}) {  // Up to 45° it is the same.
    const Vector3d light(tilt, 0.1, -1);
    EXPECT_EQ(end_through(light, {0, 0, -1}), RayEnd::plate);
    for (const Vector3d& out : std::vector<Vector3d>{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}})
      EXPECT_EQ(end_through(light, out), RayEnd::side) << out.transpose() << " with " << tilt;
  }
}

/// Light along a diagonal of a face leaves through two faces, that along a diagonal of the cube through three.
TEST(SideFacesTest, OfObliqueLightAreThoseThroughWhichItDoesNotLeave) {
  const Vector3d two(1, 0, -1), three(1, 1, -1);
  EXPECT_EQ(end_through(two, {1, 0, 0}), RayEnd::plate);
  EXPECT_EQ(end_through(two, {0, 0, -1}), RayEnd::plate);
  EXPECT_EQ(end_through(two, {0, 1, 0}), RayEnd::side);
  EXPECT_EQ(end_through(two, {-1, 0, 0}), RayEnd::side);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d out = three[axis] * Vector3d::Unit(axis);
    EXPECT_EQ(end_through(three, out), RayEnd::plate);
    EXPECT_EQ(end_through(three, -out), RayEnd::side);
  }
}

TEST(SideFacesTest, OnlyLightThatLeavesTheBoxIsMarked) {
  const Vector3d down(0, 0, -1), right(1, 0, 0);
  EXPECT_EQ(end_at(down, {0.5, 0, 0}, right), RayEnd::plate);                     // A plate within the volume.
  EXPECT_EQ(end_at(down, {5, 2, 0}, right), RayEnd::plate);                       // Light beside the volume.
  EXPECT_EQ(end_at(down, {5, 0, 3}, {1, 0, 0.1}), RayEnd::plate);                 // It has not been there, either.
  EXPECT_EQ(end_at(down, {-5, 0, 0}, right), RayEnd::plate);                      // Light that does not enter yet.
  EXPECT_EQ(end_at(down, {1 + 1e-9, 0, 0}, right), RayEnd::side);                 // At the face itself.
  EXPECT_EQ(end_at(down, {1 - 1e-9, 0, 0}, right), RayEnd::side);                 // Within rounding.
  EXPECT_EQ(end_at(down, {5, 0, 0}, right, RayEnd::missed), RayEnd::side);        // Without a plate.
  EXPECT_EQ(end_at(down, {5, 0, 0}, right, RayEnd::obstacle), RayEnd::obstacle);  // This has its own reason.
  EXPECT_EQ(end_at(down, {0, 0, 0}, down, RayEnd::step_limit), RayEnd::step_limit);
}

}  // namespace
}  // namespace tensorray
