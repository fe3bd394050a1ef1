#include "renderer/surfaces/triangle_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "renderer/meshes/mesh.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
constexpr double infinite = std::numeric_limits<double>::infinity();

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vector3d point(double extent) {
    return {uniform(-extent, extent), uniform(-extent, extent), uniform(-extent, extent)};
  }

 private:
  std::mt19937 engine_;
};

TriangleMesh soup(Random& random, std::uint32_t count, double triangle_size) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vector3d center = random.point(0.5);
    for (int corner = 0; corner < 3; ++corner) mesh.vertices.push_back(center + random.point(triangle_size));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

/// Möller and Trumbore 1997, in double precision. Sets `clear` to false if rounding to single precision may decide.
bool meets(const TriangleMesh& mesh, std::uint32_t triangle, const Vector3d& from, const Vector3d& direction,
           double& distance, bool& clear) {
  const auto& [i, j, k] = mesh.triangles[triangle];
  const Vector3d &a = mesh.vertices[i], ab = mesh.vertices[j] - a, ac = mesh.vertices[k] - a;
  const Vector3d p = direction.cross(ac), q = (from - a).cross(ab);
  const double determinant = ab.dot(p);
  const double u = (from - a).dot(p) / determinant, v = direction.dot(q) / determinant;
  const double margin = 1e-6 / std::abs(determinant);
  const double inside = std::min({u, v, 1 - u - v});
  distance = ac.dot(q) / determinant;
  if (std::abs(inside) < margin) clear = false;
  return inside >= 0;
}

std::vector<TriangleHit> brute_force(const std::vector<TriangleMesh>& meshes, const Vector3d& from,
                                     const Vector3d& direction, double min_distance, double max_distance, bool& clear) {
  std::vector<TriangleHit> hits;
  for (std::uint32_t mesh = 0; mesh < meshes.size(); ++mesh)
    for (std::uint32_t triangle = 0; triangle < meshes[mesh].triangles.size(); ++triangle) {
      double distance = 0;
      if (!meets(meshes[mesh], triangle, from, direction, distance, clear)) continue;
      if (std::min(std::abs(distance - min_distance), std::abs(distance - max_distance)) < 1e-4) clear = false;
      if (distance >= min_distance && distance <= max_distance) hits.push_back({distance, mesh, triangle});
    }
  return hits;
}

struct Soup {
  explicit Soup(unsigned seed) : random(seed) {
    meshes = {soup(random, 400, 0.2), TriangleMesh(), soup(random, 300, 0.3)};
  }
  TriangleScene scene() const { return {{&meshes[0], &meshes[1], &meshes[2]}, Vector3d(0.1, 0, 0), 2}; }

  Random random;
  std::vector<TriangleMesh> meshes;
};

/// Compares lists of hits or of ids.
template <class A, class B>
bool same(const A& a, const B& b) {
  return a.mesh == b.mesh && a.triangle == b.triangle;
}

TEST(TriangleScene, NearestAgreesWithBruteForce) {
  Soup soup(2);
  const TriangleScene scene = soup.scene();
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d from = soup.random.point(1), direction = soup.random.point(1).normalized();
    const double low = soup.random.uniform(-1, 0.2);
    bool clear = true;
    auto expected = brute_force(soup.meshes, from, direction, low, infinite, clear);
    std::sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) { return a.distance < b.distance; });
    if (!clear || (expected.size() > 1 && expected[1].distance - expected[0].distance < 1e-4)) continue;
    const auto hit = scene.nearest(from, direction, low, infinite);
    ASSERT_EQ(hit.has_value(), !expected.empty());
    if (!hit) continue;
    ASSERT_TRUE(same(*hit, expected[0]));
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
    EXPECT_EQ(std::adjacent_find(candidates.begin(), candidates.end(), same<TriangleId, TriangleId>), candidates.end());
    found += candidates.size();
  }
  EXPECT_GT(found, 0u);
}

/// Embree aborts the process on some rays; TriangleScene must not pass them on.
TEST(TriangleScene, RaysMayStartAnywhere) {
  const TriangleMesh box = box_mesh({Vector3d(-1, -1, -1), Vector3d(1, 1, 1)}, Eigen::Affine3d::Identity());
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
        if (!std::isfinite(far) || !direction.allFinite()) {
          EXPECT_FALSE(hit);
        }
        std::vector<TriangleId> candidates;
        scene.near(from, 1e-6, candidates);
        if (!(far < 1e18)) {  // Embree proposes all triangles of a tree without branches, from wherever it can compute.
          EXPECT_TRUE(candidates.empty());
        }
      }
}

TEST(TriangleScene, NearMissesNoBoxAndLeavesOutWhatIsFar) {
  Soup soup(3);
  const TriangleScene scene = soup.scene();
  std::vector<TriangleId> candidates;
  std::size_t close = 0, proposed = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d point = soup.random.point(0.7);
    const double radius = soup.random.uniform(1e-5, 0.05);
    scene.near(point, radius, candidates);
    proposed += candidates.size();
    for (std::uint32_t m = 0; m < soup.meshes.size(); ++m)
      for (std::uint32_t t = 0; t < soup.meshes[m].triangles.size(); ++t) {
        Eigen::AlignedBox3d box;
        for (const std::uint32_t vertex : soup.meshes[m].triangles[t]) box.extend(soup.meshes[m].vertices[vertex]);
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
