#include "tracing/bending/geometry.h"

#include <random>

#include "renderer/meshes/mesh.h"
#include "tests/renderer/support.h"
#include "tests/tracing/support.h"
#include "tracing/bending/bending.h"

namespace tensorray {
namespace {

Eigen::AlignedBox3d unit_box() { return {Vector3d(-1, -1, -1), Vector3d(1, 1, 1)}; }

Surfaces box_surfaces(const Eigen::Affine3d& transform = Eigen::Affine3d::Identity()) {
  Surfaces surfaces;
  surfaces.bounds = box_mesh(unit_box(), transform);
  return surfaces;
}

/// Where a line enters and leaves the box, by the slab method.
bool slabs(const Vector3d& origin, const Vector3d& direction, double& near, double& far) {
  near = -1e300, far = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-1 - origin[axis]) / direction[axis], b = (1 - origin[axis]) / direction[axis];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near < far;
}

TEST(Geometry, BoxAgreesWithTheAnalyticOne) {
  const Geometry geometry(box_surfaces());
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector3d origin = 4 * Vector3d(normal(random), normal(random), normal(random)).normalized();
    const Vector3d direction = (0.5 * Vector3d(normal(random), normal(random), normal(random)) - origin).normalized();
    double near, far;
    const bool expected = slabs(origin, direction, near, far);
    if (expected && far - near < 1e-4) continue;  // The line grazes an edge: rounding decides.
    const auto entry = geometry.crossing(Surface::bounds, true, origin, direction);
    const auto exit = geometry.crossing(Surface::bounds, false, origin, direction);
    ASSERT_EQ(entry.has_value(), expected);
    ASSERT_EQ(exit.has_value(), expected);
    if (!expected) continue;
    ++hits;
    EXPECT_NEAR(entry->distance, near, 1e-12);  // The result has double precision, although Embree's is single.
    EXPECT_NEAR(exit->distance, far, 1e-12);
    EXPECT_LT(entry->normal.dot(direction), 0);
    EXPECT_GT(exit->normal.dot(direction), 0);
  }
  EXPECT_GT(hits, 1000);
}

TEST(Geometry, IsPreciseFarFromTheOriginAndInAnyUnit) {
  const Eigen::Affine3d far(Eigen::Translation3d(1e6, -1e6, 1e6));
  std::vector<std::tuple<Eigen::Affine3d, double, double>> cases{{far, 1, 1e-8}};
  for (const double unit : {1e-20, 1e-6, 1e12, 1e20})
    cases.emplace_back(Eigen::Affine3d(Eigen::Scaling(unit)), unit, 1e-12);
  for (const auto& [placement, unit, error] : cases) {
    const Geometry geometry(box_surfaces(placement));
    const auto entry = geometry.crossing(Surface::bounds, true, placement * Vector3d(0.3, 0.2, 5), {0, 0, -1});
    const auto exit = geometry.crossing(Surface::bounds, false, placement * Vector3d(0.3, 0.2, 0), {0, 0, -1});
    ASSERT_TRUE(entry && exit) << unit;
    EXPECT_NEAR(entry->distance / unit, 4, error);
    EXPECT_NEAR(exit->distance / unit, 1, error);
  }
}

TEST(Geometry, RefusesSurfacesBeyondSinglePrecision) {
  for (const double far : {1e14, 1e40, 1e300, std::nan("")}) {
    Surfaces with_plate = box_surfaces(), with_obstacle = box_surfaces(), with_cut = box_surfaces();
    with_plate.plate = Plate();
    with_plate.plate->center = {0, 0, far};
    const TriangleMesh box = box_mesh({Vector3d(far, 0, 0), Vector3d(far, 1, 1)}, Eigen::Affine3d::Identity());
    with_obstacle.obstacles = {box_mesh(unit_box(), Eigen::Affine3d::Identity()), box};
    with_cut.cut = box;
    EXPECT_EQ(message([&] { Geometry(std::move(with_plate)); }).find("the receiver"), 0u) << far;
    EXPECT_EQ(message([&] { Geometry(std::move(with_obstacle)); }).find("obstacle 1"), 0u) << far;
    EXPECT_EQ(message([&] { Geometry(std::move(with_cut)); }).find("the mesh that cuts"), 0u) << far;
  }
}

TEST(Geometry, PlateIsHitFromBothSidesAndOnlyWithinIt) {
  Surfaces surfaces = box_surfaces();
  Plate plate;
  plate.center = {0, 0, -3};
  plate.size = {2, 1};
  surfaces.plate = plate;
  const Geometry geometry(std::move(surfaces));
  const auto below = geometry.absorber({0.9, 0.4, -5}, {0, 0, 1}), above = geometry.absorber({0.9, 0.4, 5}, {0, 0, -1});
  ASSERT_TRUE(below && above);
  EXPECT_EQ(below->surface, Surface::plate);
  EXPECT_NEAR(below->distance, 2, 1e-12);
  EXPECT_NEAR(above->distance, 8, 1e-12);
  EXPECT_FALSE(geometry.absorber({0.9, 0.6, 5}, {0, 0, -1}));
  EXPECT_FALSE(geometry.absorber({0.9, 0.4, 5}, {0, 0, -1}, 7.9));
  EXPECT_TRUE(geometry.may_absorb({0, 0, -2}, {0, 0, -4}));
  EXPECT_FALSE(geometry.may_absorb({0, 0, 1}, {0, 0, -1}));
}

TEST(Geometry, ASurfaceAtTheOriginOfARayIsHit) {
  Surfaces surfaces = box_surfaces();
  Plate plate;
  plate.center = {0, 0, 1.0 / 3};
  plate.size = {2, 2};
  surfaces.plate = plate;
  const Geometry geometry(std::move(surfaces));
  for (const double before : {0.0, 1e-9, -1e-9}) {
    const auto hit = geometry.absorber({0.1, 0.2, 1.0 / 3 + before}, {0, 0, -1});
    ASSERT_TRUE(hit) << before;
    EXPECT_GE(hit->distance, 0);
    EXPECT_LT(hit->distance, 1e-8);
  }
}

/// From the unit box to half of it.
Eigen::Affine3d turned_half() {
  return Eigen::AngleAxisd(0.5, Vector3d(1, 1, 0).normalized()) * Eigen::Affine3d(Eigen::Scaling(0.5));
}

TEST(Geometry, KnowsWhatIsInsideTheCut) {
  Surfaces surfaces = box_surfaces();
  const Eigen::Affine3d turned = turned_half();
  surfaces.cut = box_mesh(unit_box(), turned);
  const Geometry geometry(std::move(surfaces));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d point(uniform(random), uniform(random), uniform(random));
    const double depth = 1 - (turned.inverse() * point).cwiseAbs().maxCoeff();
    if (std::abs(depth) < 1e-4) continue;  // Rounding decides.
    EXPECT_EQ(geometry.inside_cut(point), depth > 0);
    const Vector3d along(0.6, 0, 0.8);
    const CutAhead ahead = geometry.cut_ahead(point, along);
    EXPECT_EQ(ahead.is_inside, depth > 0);
    const auto entry = geometry.crossing(Surface::cut, true, point, along);
    EXPECT_EQ(ahead.entry.has_value(), entry.has_value());
    if (entry && ahead.entry) {
      EXPECT_NEAR(ahead.entry->distance, entry->distance, 1e-12);
    }
  }
  EXPECT_TRUE(Geometry(box_surfaces()).inside_cut({9, 9, 9}));
}

/// Alone or together, near each other or not: none that leaves the cut or meets an obstacle is missed, also at vertices
/// and edges, and few others are found.
TEST(Geometry, NoneOfManyWaysIsMissed) {
  Surfaces surfaces = box_surfaces();
  const Eigen::Affine3d turned = turned_half();
  surfaces.cut = box_mesh(unit_box(), turned);
  surfaces.obstacles = {box_mesh({Vector3d(-0.2, -0.1, 0.1), Vector3d(0.3, 0.2, 0.25)}, turned)};
  const TriangleMesh cut = *surfaces.cut;
  const Geometry geometry(std::move(surfaces));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto anywhere = [&] { return Vector3d(uniform(random), uniform(random), uniform(random)); };
  int meet = 0, others = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d common = 0.6 * anywhere();
    Segment ways[16];
    for (int k = 0; k < 16; ++k) {
      const auto& triangle = cut.triangles[random() % cut.triangles.size()];
      const double part = k % 2 ? 0 : (uniform(random) + 1) / 2;
      const Vector3d edge = cut.vertices[triangle[0]] + part * (cut.vertices[triangle[1]] - cut.vertices[triangle[0]]);
      const Vector3d through = i % 4 == 0 ? Vector3d(edge + 1e-7 * anywhere()) : Vector3d(common + 0.05 * anywhere());
      const Vector3d along = i % 2 ? anywhere() : Vector3d(Vector3d(0.1, 0.2, 1) + 0.01 * anywhere());
      ways[k] = {through - 0.1 * along, through + 0.1 * uniform(random) * along};
    }
    const std::uint32_t all = geometry.may_meet(ways, 16);
    for (int k = 0; k < 16; ++k) {
      const double length = (ways[k].to - ways[k].from).norm();
      const Vector3d along = (ways[k].to - ways[k].from) / length;
      const bool meets = geometry.crossing(Surface::cut, false, ways[k].from, along, length) ||
                         geometry.absorber(ways[k].from, along, length);
      const bool found = (geometry.may_meet(&ways[k], 1) & all >> k & 1) != 0;
      EXPECT_TRUE(found || !meets) << i << " " << k;
      meet += meets;
      others += found && !meets;
    }
  }
  EXPECT_GT(meet, 3000);
  EXPECT_LT(others, meet / 2);
}

TEST(Plate, PixelsAndWorldAreInverse) {
  Plate plate;
  plate.center = {1, 2, 3};
  plate.right = Vector3d(1, 2, 0).normalized();
  plate.up = Vector3d(-2, 1, 0).normalized();
  plate.size = {3, 2};
  plate.resolution = {300, 100};
  EXPECT_LT((plate.to_pixel(plate.center) - Eigen::Vector2d(150, 50)).norm(), 1e-12);
  EXPECT_LT((plate.to_pixel(plate.center + 1.5 * plate.right + plate.up) - Eigen::Vector2d(300, 0)).norm(), 1e-12);
  EXPECT_LT((plate.to_pixel(plate.to_world({12.5, 77}) + 4 * plate.normal()) - Eigen::Vector2d(12.5, 77)).norm(),
            1e-12);
  EXPECT_NEAR(plate.pixel_area(), 3.0 / 300 * 2 / 100, 1e-15);
}

TEST(Plate, UprightIsAcrossTheDirection) {
  EXPECT_LT((upright({0, 0, -1}, {0, 0, 1}) - Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LT((upright({1, 0, 0}, {1, 0, 1}) - Vector3d::UnitZ()).norm(), 1e-15);
  EXPECT_LT((upright({3, 0, 0}, {0, 0, 0}) - Vector3d::UnitZ()).norm(), 1e-15);
}

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

/// Light along an axis leaves through one face, that along a diagonal of a face through two, and that along a diagonal
/// of the cube through three.
TEST(SideFacesTest, AreThoseThroughWhichStraightLightDoesNotLeave) {
  const Vector3d one(0, 0, -1);
  EXPECT_EQ(end_through(one, one), RayEnd::plate);
  for (const Vector3d& out : std::vector<Vector3d>{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}})
    EXPECT_EQ(end_through(one, out), RayEnd::side) << out.transpose();
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
