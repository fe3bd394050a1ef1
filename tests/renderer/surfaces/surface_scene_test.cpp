#include "renderer/surfaces/surface_scene.h"

#include <optional>
#include <set>

#include "base/constants.h"
#include "renderer/lights/lights.h"
#include "renderer/meshes/mesh.h"
#include "renderer/sampling/random.h"
#include "renderer/sampling/sampling.h"
#include "renderer/surfaces/triangle_scene.h"
#include "tests/renderer/shapes.h"
#include "tests/renderer/support.h"

namespace tensorray {
namespace {

constexpr double infinite = INFINITY;

Vector3d random_direction(int i) { return square_to_sphere({random_uniform(7, i, 0), random_uniform(7, i, 1)}); }

/// In [−1, 1]³.
Vector3d random_point(int i) {
  return 2 * Vector3d(random_uniform(8, i, 0), random_uniform(8, i, 1), random_uniform(8, i, 2)) - Vector3d::Ones();
}

/// Distance and normal where a ray enters a box, or leaves it if it starts inside.
std::optional<SurfaceHit> cross_box(const AlignedBox3d& box, const Vector3d& origin, const Vector3d& direction) {
  const Vector3d a = (box.min() - origin).cwiseQuotient(direction), b = (box.max() - origin).cwiseQuotient(direction);
  int enter_axis = 0, leave_axis = 0;
  const double enter = a.cwiseMin(b).maxCoeff(&enter_axis), leave = a.cwiseMax(b).minCoeff(&leave_axis);
  if (enter > leave || leave < 0) return std::nullopt;
  const bool within = enter < 0;
  const int axis = within ? leave_axis : enter_axis;
  SurfaceHit hit;
  hit.distance = within ? leave : enter;
  hit.normal[axis] = (direction[axis] > 0) == within ? 1 : -1;
  return hit;
}

ShadedSurface box_surface(const AlignedBox3d& box) { return surface_of(box_mesh(box, Affine3d::Identity())); }

/// A square about the origin, whose sides have the length 2, and which looks up.
ShadedSurface square() { return surface_of(rectangle_mesh({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 2})); }

ShadedSurface curve(const std::vector<Vector3d>& points, const std::vector<float>& radii) {
  ShadedSurface surface;
  surface.shape = RoundCurves{points, radii, {static_cast<std::uint32_t>(points.size())}};
  return surface;
}

TEST(SurfaceSceneTest, BoxIsMetWhereTheFormulaSays) {
  // Also with small boxes far from the origin of the world, where single precision is not sufficient.
  for (const double scale : {1.0, 1e-4, 1e4})
    for (const Vector3d& shift : {Vector3d(0, 0, 0), Vector3d(300, -2000, 70)}) {
      const Vector3d center = scale * shift;
      const Vector3d below(0.5, 0.6, 0.2), above(0.5, 0.3, 0.7);
      const AlignedBox3d box(center - scale * below, center + scale * above);
      const double part = scale * (1 - 1e-5);
      const AlignedBox3d inner(center - part * below, center + part * above);
      const SurfaceScene scene({box_surface(box)});
      int hits = 0;
      for (int i = 0; i < 2000; ++i) {
        const Vector3d direction = random_direction(i);
        const Vector3d origin = center + scale * (random_point(i) - (i % 3 == 0 ? 1000 : 0) * direction);
        const auto exact = cross_box(box, origin, direction);
        const auto hit = scene.intersect(origin, direction);
        // Rays along an edge may fall on either side of it.
        if (exact.has_value() != cross_box(inner, origin, direction).has_value()) continue;
        ASSERT_EQ(hit.has_value(), exact.has_value()) << i;
        if (!hit) continue;
        ++hits;
        if (hit->normal.dot(exact->normal) < 0.99) continue;  // Edges seen from inside.
        EXPECT_NEAR(hit->distance, exact->distance, 2e-6 * scale);
        EXPECT_NEAR((origin + hit->distance * direction - hit->position).norm(), 0, 2e-6 * scale);
        EXPECT_NEAR((hit->normal - exact->normal).norm(), 0, 1e-9);
        EXPECT_EQ(hit->shading_normal, hit->normal);
      }
      EXPECT_GT(hits, 500);
    }
}

TEST(SurfaceSceneTest, StraightCurvesAreCylindersWithRoundEnds) {
  const double radius = 0.1;
  const SurfaceScene scene({curve({{0, 0, -1}, {0, 0, -0.3}, {0, 0, 0.2}, {0, 0, 1}}, std::vector<float>(4, 0.1f))});
  int sides = 0, ends = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vector3d target(0.3 * random_point(i).x(), 0.3 * random_point(i).y(), 1.3 * random_point(i).z());
    const Vector3d direction = random_direction(i), origin = target - 3 * direction;
    // The distance to the capsule, by sphere tracing.
    double distance = 0, gap = 1;
    const auto nearest = [](const Vector3d& p) { return Vector3d(0, 0, std::clamp(p.z(), -1.0, 1.0)); };
    for (int step = 0; step < 500 && distance < 6 && gap > 1e-10; ++step) {
      const Vector3d p = origin + distance * direction;
      gap = (p - nearest(p)).norm() - radius;
      distance += gap;
    }
    if (gap > 1e-10 && distance < 6) continue;  // The ray nearly touches the capsule: either result is correct.
    const auto hit = scene.intersect(origin, direction);
    ASSERT_EQ(hit.has_value(), distance < 6) << i;
    if (!hit) continue;
    const Vector3d exact = origin + distance * direction, normal = (exact - nearest(exact)) / radius;
    const double cosine = -normal.dot(direction);
    EXPECT_NEAR(hit->distance, distance, 1e-6 / cosine) << i;
    EXPECT_NEAR((hit->normal - normal).norm(), 0, 2e-5 / cosine) << i;
    EXPECT_NEAR((hit->shading_normal - normal).norm(), 0, 2e-5 / cosine) << i;
    (std::abs(exact.z()) > 1 ? ends : sides) += 1;
  }
  EXPECT_GT(sides, 300);
  EXPECT_GT(ends, 20);
}

TEST(SurfaceSceneTest, TaperedCurvesAreCones) {
  // Tangent to two spheres: the sine of the half angle of the cone is (r0 − r1) / length.
  const SurfaceScene scene({curve({{0, 0, 0}, {0, 0, 1}}, {0.3f, 0.1f})});
  const double sine = 0.2, cosine = std::sqrt(1 - sine * sine);
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 + 0.9 * random_uniform(3, i, 0), turn = 2 * pi * random_uniform(3, i, 1);
    const Vector3d normal(cosine * std::cos(turn), cosine * std::sin(turn), sine);
    const Vector3d point = Vector3d(0, 0, t) + (0.3 - 0.2 * t) * normal;
    const auto hit = scene.intersect(point + normal, -normal);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, 1, 2e-6);
    EXPECT_NEAR((hit->normal - normal).norm(), 0, 1e-5);
    EXPECT_NEAR((hit->shading_normal - normal).norm(), 0, 1e-5);
  }
}

TEST(SurfaceSceneTest, BentCurvesHaveNoGapsAndSmoothNormals) {
  const int segments = 12;
  const double bend = pi / 2 / segments;
  std::vector<Vector3d> points;  // A quarter of a circle about the origin.
  for (int i = 0; i <= segments; ++i) points.emplace_back(std::cos(bend * i), std::sin(bend * i), 0);
  const SurfaceScene scene({curve(points, std::vector<float>(segments + 1, 0.05f))});
  double faceted = 0, smooth = 0, count = 0;
  for (int i = 0; i < 5000; ++i) {
    const double angle = pi / 2 * random_uniform(4, i, 0);
    const Vector3d axis(std::cos(angle), std::sin(angle), 0);
    const Vector3d direction = random_direction(i);
    const auto hit = scene.intersect(std::cos(bend / 2) * axis - 0.5 * direction, direction);
    ASSERT_TRUE(hit) << i;
    // Normals of the torus about the circle have no component along it; the ends are round.
    const Vector3d center = Vector3d(hit->position.x(), hit->position.y(), 0).normalized();
    const double at = std::atan2(center.y(), center.x());
    if (at < bend || at > pi / 2 - bend) continue;
    const Vector3d along = Vector3d::UnitZ().cross(center);
    faceted += std::pow(along.dot(hit->normal), 2);
    smooth += std::pow(along.dot(hit->shading_normal), 2);
    count += 1;
    EXPECT_GT(hit->shading_normal.dot(hit->position - center) / 0.05, 0.95);
  }
  // Normals of facets are off by up to bend / 2, uniformly. The spheres at the joints are not smoothed: a few percent.
  EXPECT_NEAR(std::sqrt(faceted / count), bend / std::sqrt(12), 0.1 * bend);
  EXPECT_LT(std::sqrt(smooth / count), 0.4 * std::sqrt(faceted / count));
}

TEST(SurfaceSceneTest, ConvexSurfacesDoNotShadowThemselves) {
  const auto tube = [](float radius) {
    return curve({{50, 0, -1}, {50, 0, -0.3}, {50, 0, 0.2}, {50, 0, 1}}, std::vector<float>(4, radius));
  };
  const SurfaceScene round({tube(0.1f)});
  const SurfaceScene box({box_surface({Vector3d(49, -1, -1), Vector3d(51, 1, 1)})});
  // A thin tube in a large scene.
  const SurfaceScene thin({tube(0.02f), box_surface({Vector3d(-20, -20, -9), Vector3d(120, 20, -8)})});
  for (const SurfaceScene* scene : {&round, &box, &thin}) {
    int hits = 0;
    for (int i = 0; i < 3000; ++i) {
      const Vector3d target(50, 0, 1.2 * random_point(i).z()), from = target + 2.5 * random_direction(i);
      const auto hit = scene->intersect(from, (target - from).normalized());
      if (!hit || hit->surface == 1) continue;
      ++hits;
      const double side = hit->normal.dot(target - from) < 0 ? 1 : -1;
      // Up to a tenth of a degree above the surface.
      Vector3d out = random_direction(i + 5000);
      if (out.dot(hit->normal) * side < 0) out = -out;
      if (std::abs(out.dot(hit->normal)) < 2e-3) continue;
      const bool may_be_met = scene == &box && side < 0;
      EXPECT_TRUE(may_be_met || !scene->occluded(scene->start(*hit, hit->position, side), out, 2)) << i;
    }
    EXPECT_GT(hits, 1000);
  }
}

TEST(SurfaceSceneTest, OccludersBehindTheTargetDoNotCount) {
  const SurfaceScene scene({square()});
  const Vector3d down(0, 0, -1);
  EXPECT_FALSE(scene.occluded({0.1, 0.2, 1}, down, 1));  // The surface hit is the target itself.
  EXPECT_FALSE(scene.occluded({0.1, 0.2, 1}, down, 0.9));
  EXPECT_TRUE(scene.occluded({0.1, 0.2, 1}, down, 1.01));
  EXPECT_TRUE(scene.occluded({0.1, 0.2, 1}, down));
  EXPECT_FALSE(scene.occluded({0.1, 0.2, 1}, -down));
  EXPECT_TRUE(scene.occluded({0.1, 0.2, 1e7}, down));
}

TEST(SurfaceSceneTest, SmoothNormalsLiftPointsToTheSmoothSurface) {
  const SurfaceScene scene({sphere(12)});
  double flat = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d direction = random_direction(i);
    const auto outer = scene.intersect(-3 * direction, direction);
    const auto inner = scene.intersect(Vector3d::Zero(), direction);
    ASSERT_TRUE(outer && inner);
    flat = std::max(flat, 1 - outer->position.norm());
    EXPECT_NEAR((outer->shading_normal - outer->position.normalized()).norm(), 0, 0.03);
    // The smooth surface is closer to the sphere than the triangles are, and never below them.
    EXPECT_GE(outer->lifted_position.norm(), outer->position.norm());
    EXPECT_LT(std::abs(outer->lifted_position.norm() - 1), 0.035);
    EXPECT_NEAR((inner->lifted_position - inner->position).norm(), 0, 1e-12);  // From inside, the surface is concave.
  }
  EXPECT_GT(flat, 0.015);
}

TEST(SurfaceSceneTest, DataAreInterpolatedAndPathsAreCounted) {
  ShadedSurface flat = square();
  for (const Vector3d& p : std::get<TriangleMesh>(flat.shape).vertices) {
    flat.colors.emplace_back(Vector3f(0.5f, 0.25f, 0.1f) * static_cast<float>(1 + p.x() / 2));
    flat.forces.push_back(static_cast<float>(3 + p.x() - p.y()));
    flat.arc_lengths.push_back(static_cast<float>(5 + 2 * p.y()));
  }
  flat.path_ends = {0, 1, 1, 2};  // Two of the four paths have no triangles.
  flat.first_path = 10;
  ShadedSurface curves;
  curves.shape = RoundCurves{{{5, 0, 0}, {6, 0, 0}, {7, 0, 0}, {5, 1, 0}, {6, 1, 0}, {6, 1, 0}, {7, 1, 0}},
                             std::vector<float>(7, 0.1f),
                             {3, 3, 7}};
  curves.forces = {0, 1, 2, 5, 6, 6, 7};
  curves.strands_are_paths = true;
  const SurfaceScene scene({flat, surface_of({}), curves});

  const auto data_at = [&](double x, double y) {
    const auto hit = scene.intersect({x, y, 3}, {0, 0, -1});
    EXPECT_TRUE(hit);
    return scene.data(*hit);
  };
  EXPECT_NEAR((scene.intersect({0.5, 0.25, 3}, {0, 0, -1})->color - Vector3f(0.5f, 0.25f, 0.1f) * 1.25f).norm(), 0,
              1e-6);
  EXPECT_NEAR(*data_at(0.5, 0.25).force, 3.25, 1e-5);
  EXPECT_NEAR(*data_at(0.5, 0.25).arc_length, 5.5, 1e-5);
  EXPECT_EQ(data_at(0.5, 0.25).path, 11u);
  EXPECT_EQ(data_at(-0.5, 0.25).path, 13u);
  EXPECT_NEAR(*data_at(5.75, 0.02).force, 0.75, 1e-5);
  EXPECT_FALSE(data_at(5.75, 0.02).arc_length);
  EXPECT_EQ(data_at(6.5, 0).path, 0u);
  EXPECT_EQ(data_at(6.5, 1).path, 2u);
  EXPECT_NEAR(*data_at(6.5, 1).force, 6.5, 1e-5);  // After a point that occurs twice.
}

/// Embree aborts the process on some rays; SurfaceScene must not pass them on.
TEST(SurfaceSceneTest, RaysMayStartAnywhere) {
  const SurfaceScene scene({square()});
  const Vector3d down(0, 0, -1);
  for (const double far : {1e3, 1e9}) {
    EXPECT_NEAR(scene.intersect({0.3, 0.2, far}, down)->distance, far, 1e-6 + 1e-15 * far);
    EXPECT_TRUE(scene.occluded({0.3, 0.2, far}, down));
  }
  const double nan = std::nan("");
  for (const double far : {1e20, 1e40, 1e200, 1e300, infinite, nan})
    for (const Vector3d& from : {Vector3d(far, 0, 0), Vector3d(0.3, 0.2, far), Vector3d(far, -far, far)})
      for (const Vector3d& direction : {down, Vector3d(0.6, 0, -0.8), Vector3d(nan, 0, 1)}) {
        const auto hit = scene.intersect(from, direction);  // Any result is correct, but the call must return.
        const bool shadowed = scene.occluded(from, direction, 1e300);
        const bool may_meet_it = from.x() != far && direction.allFinite();
        EXPECT_TRUE(may_meet_it || !(hit || shadowed));
      }
}

TEST(SurfaceSceneTest, BadSurfacesAreNamed) {
  const ShadedSurface strand = curve({{0, 0, 0}, {1, 0, 0}}, {0.1f, 0.1f});
  ShadedSurface forces = square(), index = forces, paths = forces, radius = strand, strands = strand;
  forces.forces = {1, 2};
  std::get<TriangleMesh>(index.shape).triangles.push_back({0, 1, 4});
  paths.path_ends = {1};
  std::get<RoundCurves>(radius.shape).radii[1] = -0.1f;
  std::get<RoundCurves>(strands.shape).strand_ends = {3};
  std::vector<std::pair<ShadedSurface, std::string>> bad{
      {forces, "there must be no forces, or a finite one for each point"},
      {index, "a triangle has a corner that is none of the vertices"},
      {paths, "path_ends must ascend to the number of triangles"},
      {radius, "a radius is not a finite value >= 0"},
      {strands, "strand_ends must ascend to the number of points"}};
  for (const double far : {std::nan(""), 1e39}) {
    bad.emplace_back(square(), "a vertex is not finite in single precision");
    std::get<TriangleMesh>(bad.back().first.shape).vertices[0].x() = far;
  }
  for (const auto& [surface, error] : bad)
    EXPECT_EQ(message([&, each = surface] { SurfaceScene({square(), each}); }), "surface 1: " + error);
}

/// The same rays end there alone, together and on their way to a light.
TEST(SurfaceSceneTest, ATranslucentSurfaceIsMetByAPartOfTheRays) {
  ShadedSurface translucent = square();
  translucent.opacity = 0.3f;
  const SurfaceScene scene({translucent, surface_of(rectangle_mesh({0, 0, -1}, {1, 0, 0}, {0, 1, 0}, {4, 4}))});
  for (const double height : {3.0, 30.0}) {
    std::vector<StraightRay> rays;
    for (int i = 0; i < 40000; ++i) {
      const Vector3d place(i % 200 / 101.0 - 0.97, i / 200 / 101.0 - 0.97, 0), from(0, 0, height);
      rays.push_back({from, (place - from).normalized()});
    }
    std::vector<std::optional<SurfaceHit>> hits;
    scene.intersect(rays, hits);
    int met = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto& [from, direction] = rays[i];
      EXPECT_EQ(scene.intersect(from, direction)->surface, hits[i]->surface);
      EXPECT_EQ(scene.occluded(from, direction, height + 0.6), hits[i]->surface == 0);
      met += hits[i]->surface == 0 ? 1 : 0;
    }
    EXPECT_NEAR(met / 40000.0, 0.3, 4 * std::sqrt(0.3 * 0.7 / 40000)) << height;
  }
}

/// Triangles anywhere in [−½, ½]³. @param first  Number of the first random point; each triangle takes four.
TriangleMesh soup(int first, std::uint32_t count, double triangle_size) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const int at = first + 4 * static_cast<int>(i);
    for (const int corner : {1, 2, 3})
      mesh.vertices.push_back(0.5 * random_point(at) + triangle_size * random_point(at + corner));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

/// All that a ray meets from `min_distance` on (Möller and Trumbore 1997, in double precision). Sets `clear` to false
/// if rounding to single precision may decide.
std::vector<TriangleHit> brute_force(const std::vector<TriangleMesh>& meshes, const Vector3d& from,
                                     const Vector3d& direction, double min_distance, bool& clear) {
  std::vector<TriangleHit> hits;
  for (std::uint32_t mesh = 0; mesh < meshes.size(); ++mesh)
    for (std::uint32_t triangle = 0; triangle < meshes[mesh].triangles.size(); ++triangle) {
      const auto& [i, j, k] = meshes[mesh].triangles[triangle];
      const auto& vertices = meshes[mesh].vertices;
      const Vector3d &a = vertices[i], ab = vertices[j] - a, ac = vertices[k] - a;
      const Vector3d p = direction.cross(ac), q = (from - a).cross(ab);
      const double determinant = ab.dot(p), distance = ac.dot(q) / determinant;
      const double u = (from - a).dot(p) / determinant, v = direction.dot(q) / determinant;
      const double inside = std::min({u, v, 1 - u - v});
      if (std::abs(inside) < 1e-6 / std::abs(determinant)) clear = false;
      if (inside < 0) continue;
      if (std::abs(distance - min_distance) < 1e-4) clear = false;
      if (distance >= min_distance) hits.push_back({distance, mesh, triangle});
    }
  return hits;
}

const std::vector<TriangleMesh> soups{soup(10000, 400, 0.2), TriangleMesh(), soup(20000, 300, 0.3)};

TriangleScene scene_of_soups() { return {{&soups[0], &soups[1], &soups[2]}, Vector3d(0.1, 0, 0), 2}; }

TEST(TriangleScene, NearestAgreesWithBruteForce) {
  const TriangleScene scene = scene_of_soups();
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d from = random_point(i), direction = random_direction(i);
    const double low = 1.2 * random_uniform(9, i, 0) - 1;
    bool clear = true;
    auto expected = brute_force(soups, from, direction, low, clear);
    std::sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) { return a.distance < b.distance; });
    if (!clear || (expected.size() > 1 && expected[1].distance - expected[0].distance < 1e-4)) continue;
    const auto hit = scene.nearest(from, direction, low, infinite);
    ASSERT_EQ(hit.has_value(), !expected.empty());
    if (!hit) continue;
    ASSERT_EQ(std::pair(hit->mesh, hit->triangle), std::pair(expected[0].mesh, expected[0].triangle));
    EXPECT_NEAR(hit->distance, expected[0].distance, 1e-4);
    ++compared;
  }
  EXPECT_GT(compared, 500);
}

TEST(TriangleScene, NearReportsLongTrianglesOnce) {
  TriangleMesh mesh;  // Long, diagonal triangles, which a search tree splits into pieces.
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const double shift = i * 1e-3;
    mesh.vertices.insert(mesh.vertices.end(), {{shift, -1, 0}, {shift + 1e-3, -1, 0.1}, {shift + 2, 1, 2}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const TriangleScene scene({&mesh}, Vector3d(2, 0, 1), 4);
  std::vector<TriangleId> candidates;
  std::size_t found = 0;
  for (double x = 0; x < 4; x += 0.01) {
    scene.near({x, 0.3, 0.5}, 0.1, candidates);
    std::set<std::uint32_t> triangles;
    for (const TriangleId& id : candidates) triangles.insert(id.triangle);
    EXPECT_EQ(triangles.size(), candidates.size());
    found += candidates.size();
  }
  EXPECT_GT(found, 0u);
}

/// Embree aborts the process on some rays; TriangleScene must not pass them on.
TEST(TriangleScene, RaysMayStartAnywhere) {
  const TriangleMesh box = box_mesh({Vector3d(-1, -1, -1), Vector3d(1, 1, 1)}, Affine3d::Identity());
  const TriangleScene scene({&box}, Vector3d::Zero(), 3);
  const Vector3d down(0, 0, -1), oblique = Vector3d(-0.2, 0.3, -1).normalized();
  for (const double far : {1e2, 1e5, 1e8, 1e11}) {
    for (const Vector3d& direction : {down, oblique}) {
      const auto hit = scene.nearest(Vector3d(0.3, 0.2, 1) - far * direction, direction, 0, infinite);
      ASSERT_TRUE(hit) << far;
      EXPECT_NEAR(hit->distance, far, 1e-6 + 1e-15 * far) << "found in double precision";
    }
    EXPECT_FALSE(scene.nearest({0.3, 0.2, far}, -down, 0, infinite)) << far;
    EXPECT_FALSE(scene.nearest({3, 0.2, far}, down, 0, infinite)) << far;
    EXPECT_FALSE(scene.nearest({0.3, 0.2, far}, down, 0, far - 3)) << far;
    EXPECT_TRUE(scene.nearest({0.3, 0.2, 0}, down, -far, infinite)) << far;
  }
  const double nan = std::nan("");
  for (const double far : {1e15, 1e19, 1e30, 1e50, 1e300, infinite, nan})
    for (const Vector3d& from : {Vector3d(far, 0, 0), Vector3d(0.3, 0.2, far), Vector3d(-far, far, far)})
      for (const Vector3d& direction : {down, oblique, Vector3d(0, nan, 1), Vector3d(nan, nan, nan)}) {
        // Any result is correct, but the call must return.
        const auto hit = scene.nearest(from, direction, -1e-3, infinite);
        EXPECT_TRUE((std::isfinite(far) && direction.allFinite()) || !hit);
        std::vector<TriangleId> candidates;
        scene.near(from, 1e-6, candidates);
        // Embree proposes all triangles of a tree without branches, from wherever it can compute.
        EXPECT_TRUE(far < 1e18 || candidates.empty());
      }
}

TEST(TriangleScene, NearMissesNoBoxAndLeavesOutWhatIsFar) {
  const TriangleScene scene = scene_of_soups();
  std::vector<TriangleId> candidates;
  std::size_t close = 0, proposed = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d point = 0.7 * random_point(i);
    const double radius = 1e-5 + 0.05 * random_uniform(9, i, 0);
    scene.near(point, radius, candidates);
    proposed += candidates.size();
    for (std::uint32_t m = 0; m < soups.size(); ++m)
      for (std::uint32_t t = 0; t < soups[m].triangles.size(); ++t) {
        AlignedBox3d box;
        for (const std::uint32_t vertex : soups[m].triangles[t]) box.extend(soups[m].vertices[vertex]);
        if (box.exteriorDistance(point) > radius - 2e-6) continue;
        ++close;
        EXPECT_TRUE(std::any_of(candidates.begin(), candidates.end(),
                                [&](const TriangleId& id) { return id.mesh == m && id.triangle == t; }));
      }
  }
  EXPECT_GT(close, 1000u);
  EXPECT_LT(proposed, 500 * 700u / 4);
}

TEST(TriangleScene, NothingIsFoundWhereThereAreNoTriangles) {
  const SurfaceScene empty({});
  EXPECT_FALSE(empty.intersect({0, 0, 0}, {0, 0, 1}));
  EXPECT_FALSE(empty.occluded({0, 0, 0}, {0, 0, 1}));
  EXPECT_TRUE(empty.bounds().isEmpty());
  const TriangleMesh none;
  for (const auto& meshes : {std::vector<const TriangleMesh*>{}, std::vector<const TriangleMesh*>{&none, &none}}) {
    const TriangleScene scene(meshes, Vector3d::Zero(), 1);
    EXPECT_FALSE(scene.nearest(Vector3d::Zero(), Vector3d::UnitX(), -1, infinite));
    std::vector<TriangleId> candidates(1);
    scene.near(Vector3d::Zero(), 1, candidates);
    EXPECT_TRUE(candidates.empty());
  }
}

}  // namespace
}  // namespace tensorray
