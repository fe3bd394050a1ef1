#include "tracing/bending/geometry.h"

#include "renderer/meshes/mesh.h"
#include "tests/files.h"
#include "tests/renderer/shapes.h"
#include "tests/tracing/packet_support.h"
#include "tracing/bending/bending.h"

namespace tensorray {
namespace {

AlignedBox3d unit_box() { return {Vector3d(-1, -1, -1), Vector3d(1, 1, 1)}; }

Surfaces box_surfaces(const Affine3d& transform = Affine3d::Identity()) {
  Surfaces surfaces;
  surfaces.bounds = box_mesh(unit_box(), transform);
  return surfaces;
}

TEST(Geometry, BoxAgreesWithTheAnalyticOne) {
  const Geometry geometry(box_surfaces());
  Numbers numbers(1);
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector3d origin = 4 * numbers.direction(), target = 1.5 * numbers.in(unit_box());
    const Vector3d direction = (target - origin).normalized(), behind = origin + 8 * direction;
    const double near = box_entry(Vector3d::Ones(), origin, direction);
    const double far = 8 - box_entry(Vector3d::Ones(), behind, -direction);
    const bool expected = near < INFINITY;
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
  EXPECT_LT(hits, 4000);
}

TEST(Geometry, IsPreciseFarFromTheOriginAndInAnyUnit) {
  std::vector<std::tuple<Affine3d, double, double>> cases{{Affine3d(Eigen::Translation3d(1e6, -1e6, 1e6)), 1, 1e-8}};
  for (const double unit : {1e-20, 1e-6, 1e12, 1e20}) cases.emplace_back(Affine3d(Eigen::Scaling(unit)), unit, 1e-12);
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
    const TriangleMesh box = box_between({far, 0, 0}, {far, 1, 1});
    with_plate.plate = plate_across({0, 0, -1}, far);
    with_obstacle.obstacles = {box_surfaces().bounds, box};
    with_cut.cut = box;
    const auto refused = [](const Surfaces& surfaces) { return message([&] { Geometry{Surfaces(surfaces)}; }); };
    EXPECT_THAT(refused(with_plate), StartsWith("the receiver")) << far;
    EXPECT_THAT(refused(with_obstacle), StartsWith("obstacle 1")) << far;
    EXPECT_THAT(refused(with_cut), StartsWith("the mesh that cuts")) << far;
  }
}

TEST(Geometry, PlateIsHitFromBothSidesAndOnlyWithinIt) {
  Surfaces surfaces = box_surfaces();
  surfaces.plate = plate_across({0, 0, -1}, 3);
  surfaces.plate->size = {2, 1};
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
  surfaces.plate = plate_across({0, 0, -1}, -1.0 / 3);
  const Geometry geometry(std::move(surfaces));
  for (const double before : {0.0, 1e-9, -1e-9}) {
    const auto hit = geometry.absorber({0.1, 0.2, 1.0 / 3 + before}, {0, 0, -1});
    ASSERT_TRUE(hit) << before;
    EXPECT_GE(hit->distance, 0);
    EXPECT_LT(hit->distance, 1e-8);
  }
}

/// From the unit box to half of it.
Affine3d turned_half() {
  return Eigen::AngleAxisd(0.5, Vector3d(1, 1, 0).normalized()) * Affine3d(Eigen::Scaling(0.5));
}

TEST(Geometry, KnowsWhatIsInsideTheCut) {
  Surfaces surfaces = box_surfaces();
  const Affine3d turned = turned_half();
  surfaces.cut = box_mesh(unit_box(), turned);
  const Geometry geometry(std::move(surfaces));
  Numbers numbers(2);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d point = numbers.in(unit_box());
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
  const Affine3d turned = turned_half();
  surfaces.cut = box_mesh(unit_box(), turned);
  surfaces.obstacles = {box_mesh({Vector3d(-0.2, -0.1, 0.1), Vector3d(0.3, 0.2, 0.25)}, turned)};
  const TriangleMesh cut = *surfaces.cut;
  const Geometry geometry(std::move(surfaces));
  Numbers numbers(3);
  const auto anywhere = [&] { return numbers.in(unit_box()); };
  int meet = 0, others = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d common = 0.6 * anywhere();
    Segment ways[16];
    for (int k = 0; k < 16; ++k) {
      const auto& triangle = cut.triangles[numbers.below(cut.triangles.size())];
      const double part = k % 2 ? 0 : numbers.next();
      const Vector3d edge = cut.vertices[triangle[0]] + part * (cut.vertices[triangle[1]] - cut.vertices[triangle[0]]);
      const Vector3d through = i % 4 == 0 ? Vector3d(edge + 1e-7 * anywhere()) : Vector3d(common + 0.05 * anywhere());
      const Vector3d along = i % 2 ? anywhere() : Vector3d(Vector3d(0.1, 0.2, 1) + 0.01 * anywhere());
      ways[k] = {through - 0.1 * along, through + 0.1 * numbers.between(-1, 1) * along};
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
  EXPECT_LT((plate.to_pixel(plate.center) - Vector2d(150, 50)).norm(), 1e-12);
  EXPECT_LT((plate.to_pixel(plate.center + 1.5 * plate.right + plate.up) - Vector2d(300, 0)).norm(), 1e-12);
  EXPECT_LT((plate.to_pixel(plate.to_world({12.5, 77}) + 4 * plate.normal()) - Vector2d(12.5, 77)).norm(), 1e-12);
  EXPECT_NEAR(plate.pixel_area(), 3.0 / 300 * 2 / 100, 1e-15);
}

TEST(Plate, UprightIsAcrossTheDirection) {
  EXPECT_LT((upright({0, 0, -1}, {0, 0, 1}) - Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LT((upright({1, 0, 0}, {1, 0, 1}) - Vector3d::UnitZ()).norm(), 1e-15);
  EXPECT_LT((upright({3, 0, 0}, {0, 0, 0}) - Vector3d::UnitZ()).norm(), 1e-15);
}

/// The end of a ray that goes straight through the cube [-1, 1]³ and is found at `position` behind it.
RayEnd end_at(const Vector3d& light, const Vector3d& position, const Vector3d& direction, RayEnd end = RayEnd::plate) {
  const TensorField field = test::constant_field(Matrix3d::Identity());
  RayBatch batch;
  batch.add(position, direction.normalized(), 0);
  batch.end = {end};
  SideFaces(field, light).mark(batch);
  return batch.end[0];
}

/// Light along an axis leaves through one face, that along a diagonal of a face through two, and that along a diagonal
/// of the cube through three.
TEST(SideFacesTest, AreThoseThroughWhichStraightLightDoesNotLeave) {
  for (const Vector3d& light : {Vector3d(0, 0, -1), Vector3d(1, 0, -1), Vector3d(1, 1, -1)})
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1, 1}) {
        const Vector3d out = side * Vector3d::Unit(axis);
        EXPECT_EQ(end_at(light, 5 * out, out), light.dot(out) > 0 ? RayEnd::plate : RayEnd::side)
            << light.transpose() << " through " << out.transpose();
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
