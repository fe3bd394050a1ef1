// Meshes of landings: they have no cracks, they are accurate, they are torn where the map is torn, and a search finds
// every sheet.

#include "integrators/lens/lens_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/integrators/support.h"

namespace tensorray {
namespace {

using namespace test;
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Plate plane_at(double z) {
  Plate plate;
  plate.center = {0, 0, z};
  return plate;
}

/// Light along +z, between planes 1.2 away from the middle.
LensMap make_map(const TensorField& field) {
  return LensMap(field, surfaces_of(field), {}, plane_at(-1.2), plane_at(1.2), {0, 0, 1});
}

LensLanding land(const LensMap& map, const Vector2d& start, double s) {
  LensLanding landing;
  map.trace({start}, {s}, &landing);
  return landing;
}

LensMesh make_mesh(const LensMap& map, double s, const LensMeshSettings& settings) {
  TraceCounts counts;
  return make_lens_mesh(map, s, settings, counts, Progress());
}

LensMeshSettings mesh_settings(double extent, double target, double pixel) {
  const Eigen::Vector2d corner = Eigen::Vector2d::Constant(extent / 2);
  LensMeshSettings settings;
  settings.starts = {-corner, corner};
  settings.target.setConstant(target);
  settings.pixel.setConstant(pixel);
  return settings;
}

/// Spreads light along +z: about fivefold in the middle, less and less towards the sides.
TensorField spreading_field() {
  return cube_field(17, [](const Vector3d& p) {
    Matrix3d T = Matrix3d::Zero();
    T.col(2) << 1.5 * std::sin(2 * p.x()) * std::cos(p.y()), 1.5 * std::sin(2 * p.y()) + 0.8 * p.x(), 0;
    return T;
  });
}

constexpr double spreading_s = 0.5;

double area(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return ((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x()) / 2;
}

/// The start that lands at `point`, by Newton's method from the landing of `mesh` nearest to it.
Vector2d start_of(const LensMap& map, double s, const LensMesh& mesh, const Vector2d& point) {
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < mesh.starts.size(); ++i)
    if ((mesh.landings[i].at - point).norm() < (mesh.landings[nearest].at - point).norm()) nearest = i;
  Vector2d start = mesh.starts[nearest];
  for (int i = 0; i < 8; ++i) {
    const LensLanding landing = land(map, start, s);
    start -= landing.jacobian.inverse() * (landing.at - point);
  }
  EXPECT_LT((land(map, start, s).at - point).norm(), 10 * single_precision);  // The slope of the map is up to ten.
  return start;
}

TEST(LensMesh, SmoothMapsHaveNoCracks) {
  const TensorField field = spreading_field();
  const LensMap map = make_map(field);
  const LensMeshSettings settings = mesh_settings(0.4, 2, 0.05);
  const LensMesh mesh = make_mesh(map, spreading_s, settings);
  ASSERT_EQ(mesh.starts.size(), mesh.landings.size());
  ASSERT_EQ(mesh.starts.size(), mesh.mesh.vertices.size());

  // The triangles of starts cover the rectangle once. Every edge has a triangle on either side, except on the border.
  double covered = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& triangle : mesh.mesh.triangles) {
    const double part = area(mesh.starts[triangle[0]], mesh.starts[triangle[1]], mesh.starts[triangle[2]]);
    EXPECT_GT(std::abs(part), 0);
    covered += std::abs(part);
    for (int i = 0; i < 3; ++i) ++edges[std::minmax(triangle[i], triangle[(i + 1) % 3])];
  }
  EXPECT_NEAR(covered, settings.starts.volume(), 1e-12);
  const auto on_border = [&](const Vector2d& a, const Vector2d& b) {
    for (int axis = 0; axis < 2; ++axis)
      if (std::abs(std::abs(a[axis]) - 0.2) < 1e-12 && a[axis] == b[axis]) return true;
    return false;
  };
  for (const auto& [edge, count] : edges)
    EXPECT_EQ(count, on_border(mesh.starts[edge.first], mesh.starts[edge.second]) ? 1 : 2);
  // No two vertices are at the same place, which would be a crack of width zero.
  std::set<std::pair<double, double>> places;
  for (const Vector2d& start : mesh.starts) places.emplace(start.x(), start.y());
  EXPECT_EQ(places.size(), mesh.starts.size());
}

TEST(LensMesh, SheetsAreWithinAFractionOfAPixelOfTheMap) {
  const TensorField field = spreading_field();
  const LensMap map = make_map(field);
  const double pixel = 0.05;
  const LensMesh mesh = make_mesh(map, spreading_s, mesh_settings(0.4, 2, pixel));
  EXPECT_GT(land(map, {0, 0}, spreading_s).jacobian.determinant(), 9);  // The map magnifies strongly.
  EXPECT_GT(mesh.mesh.triangles.size(), 50u);                           // The first lattice had 8.
  const SheetSearch search(mesh, pixel);
  std::vector<Sheet> sheets;
  int inside = 0;
  double worst = 0;
  for (int y = 0; y < 37; ++y)
    for (int x = 0; x < 37; ++x) {
      const Vector2d point = Vector2d(x - 18, y - 18) * (0.95 / 18);
      const Vector2d start = start_of(map, spreading_s, mesh, point);
      search.find(point, sheets);
      // The border of the mesh is that of the map within its accuracy.
      const double margin = 0.2 * pixel;
      if ((start.cwiseAbs().array() > 0.2 + margin).any()) {
        EXPECT_TRUE(sheets.empty());
      }
      if ((start.cwiseAbs().array() > 0.2 - margin).any()) continue;
      ++inside;
      ASSERT_EQ(sheets.size(), 1u) << point.transpose();
      const LensLanding landing = land(map, start, spreading_s);
      worst = std::max(worst, (landing.jacobian * (sheets[0].start - start)).norm() / pixel);
      EXPECT_LT((sheets[0].jacobian - landing.jacobian).norm(), 0.1 * landing.jacobian.norm());
      EXPECT_NEAR(sheets[0].length, landing.length, 0.1 * landing.length);
    }
  EXPECT_GT(inside, 500);
  EXPECT_LT(worst, 0.2);  // A tenth of a pixel on edges, somewhat more within triangles.
}

TEST(LensMesh, PixelsThatAreNotSquareTakeRaysByTheirNumber) {
  const TensorField field = spreading_field();
  const LensMap map = make_map(field);
  LensMeshSettings settings = mesh_settings(0.4, 2, 0);
  settings.pixel = {0.25, 0.25 / 128};  // 8192 pixels, and 33 million squares of their shorter side.
  const LensMesh mesh = make_mesh(map, spreading_s, settings);
  // The number that refinement is allowed for 8192 pixels. By their shorter side it would be 4096 times 4096 at once.
  EXPECT_LT(mesh.starts.size(), (1u << 14) + 4 * 8192u);
  const SheetSearch search(mesh, settings.pixel.minCoeff());
  std::vector<Sheet> sheets;
  double worst = 0;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x) {
      const Vector2d start = Vector2d(x - 9.7, y - 9.6) * (0.19 / 10);
      const LensLanding landing = land(map, start, spreading_s);
      if ((landing.at.array().abs() > 1).any()) continue;
      search.find(landing.at, sheets);
      ASSERT_EQ(sheets.size(), 1u) << start.transpose();
      worst = std::max(worst, (landing.jacobian * (sheets[0].start - start)).cwiseQuotient(settings.pixel).norm());
    }
  EXPECT_LT(worst, 0.2);

  // The same with starts whose axes differ from the pixels' axes. The map is the one of this field, turned.
  Plate turned = map.from();
  turned.right = map.from().up;
  turned.up = -map.from().right;
  const LensMap turned_map(field, surfaces_of(field), {}, turned, map.to(), Vector3d::UnitZ());
  settings.turn << 0, -1, 1, 0;  // Right in the starts is up in the pixels.
  EXPECT_NEAR(static_cast<double>(make_mesh(turned_map, spreading_s, settings).starts.size()),
              static_cast<double>(mesh.starts.size()), 0.1 * static_cast<double>(mesh.starts.size()));
  settings.turn = Eigen::Rotation2Dd(0.7).matrix();
  Plate askew = map.from();
  askew.right = {std::cos(0.7), std::sin(0.7), 0};
  askew.up = {-std::sin(0.7), std::cos(0.7), 0};
  const LensMap askew_map(field, surfaces_of(field), {}, askew, map.to(), Vector3d::UnitZ());
  EXPECT_LT(make_mesh(askew_map, spreading_s, settings).starts.size(), (1u << 14) + 4 * 8192u);
}

TEST(LensMesh, TellsHowFarItIs) {
  const TensorField field = spreading_field();
  const LensMap map = make_map(field);
  std::vector<double> parts;
  TraceCounts counts;
  make_lens_mesh(map, spreading_s, mesh_settings(0.4, 2, 0.01), counts, Progress(),
                 [&](double part) { parts.push_back(part); });
  EXPECT_GT(parts.size(), 2u);
  EXPECT_EQ(parts.front(), 0);
  EXPECT_LT(parts.back(), 1);
  EXPECT_TRUE(std::is_sorted(parts.begin(), parts.end()));
  const auto stop = [](double part) {
    if (part > 0) throw Cancelled();
  };
  EXPECT_THROW(make_lens_mesh(map, spreading_s, mesh_settings(0.4, 2, 0.01), counts, Progress(), stop), Cancelled);
}

/// Turns light along +z towards +y. The volume's silhouette tears the map: beside it light goes straight.
TensorField turning_field(double rate) {
  Matrix3d T = Matrix3d::Zero();
  T(1, 2) = rate;
  T(2, 1) = -rate;
  return constant_field(T);
}

TEST(LensMesh, TornMapsHaveNoTrianglesAcrossTheTear) {
  const double rate = 0.3, angle = std::asin(2 * rate);
  const double aside = (1 - std::cos(angle)) / rate + 0.2 * std::tan(angle);
  const TensorField field = turning_field(rate);
  const LensMap map = make_map(field);
  const double pixel = 0.1;
  const LensMesh mesh = make_mesh(map, 1, mesh_settings(3, 3, pixel));
  for (const auto& triangle : mesh.mesh.triangles) {
    bool bent = false, straight = false;
    for (const std::uint32_t vertex : triangle) {
      const double moved = (mesh.landings[vertex].at - mesh.starts[vertex]).norm();
      straight = straight || moved < 0.01 * aside;
      bent = bent || moved > 0.99 * aside;
    }
    EXPECT_FALSE(bent && straight) << mesh.starts[triangle[0]].transpose();
  }
  const SheetSearch search(mesh, pixel);
  std::vector<Sheet> sheets;
  const double margin = pixel / 4;  // The tear is located to 1/8 pixel; its triangles are left out.
  int lit = 0, dark = 0;
  for (double y = -1.47; y < 0.8; y += 0.021)
    for (double x = -1.47; x < 1.48; x += 0.037) {
      search.find({x, y}, sheets);
      const bool near_side = std::abs(std::abs(x) - 1) < margin;
      const bool near_gap = std::abs(y + 1) < margin || std::abs(y + 1 - aside) < margin;
      if (near_side || (near_gap && std::abs(x) < 1)) continue;
      const bool in_gap = std::abs(x) < 1 && y > -1 && y < -1 + aside;
      EXPECT_EQ(sheets.size(), in_gap ? 0u : 1u) << x << " " << y;
      ++(in_gap ? dark : lit);
      if (in_gap || sheets.size() != 1) continue;
      const Vector2d expected(x, std::abs(x) < 1 && y > -1 ? y - aside : y);
      EXPECT_LT((sheets[0].start - expected).norm(), 0.02 * pixel);
    }
  EXPECT_GT(dark, 500);
  EXPECT_GT(lit, 2000);
}

TEST(LensMesh, ShadowsOfObstaclesAreSharp) {
  const TensorField field = constant_field(Matrix3d::Zero());
  Surfaces surfaces = surfaces_of(field);
  surfaces.obstacles.push_back(box_mesh(Eigen::AlignedBox3d(Vector3d(-0.33, -0.21, 0.2), Vector3d(0.27, 0.44, 0.4)),
                                        Eigen::Affine3d::Identity()));
  const LensMap map(field, surfaces, {}, plane_at(-1.2), plane_at(1.2), {0, 0, 1});
  const double pixel = 0.1;
  const LensMesh mesh = make_mesh(map, 1, mesh_settings(2, 2, pixel));
  const SheetSearch search(mesh, pixel);
  std::vector<Sheet> sheets;
  for (double y = -0.99; y < 1; y += 0.031)
    for (double x = -0.99; x < 1; x += 0.031) {
      const double outside = std::max({-0.33 - x, x - 0.27, -0.21 - y, y - 0.44});
      if (std::abs(outside) < pixel / 4) continue;
      search.find({x, y}, sheets);
      EXPECT_EQ(sheets.size(), outside > 0 ? 1u : 0u) << x << " " << y;
    }
}

LensLanding landing_at(const Vector2d& at, double length = 1, RayEnd end = RayEnd::plate) {
  LensLanding landing;
  landing.end = end;
  landing.at = at;
  landing.length = length;
  return landing;
}

TEST(LensMesh, LatticeLeavesOutRaysThatDidNotLand) {
  std::vector<Vector2d> starts;
  std::vector<LensLanding> landings;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) {
      starts.emplace_back(x, -y);
      landings.push_back(landing_at({x, -y}));
    }
  EXPECT_EQ(lattice_mesh(starts, landings, 3, 3, 1).mesh.triangles.size(), 8u);
  landings[4].end = RayEnd::obstacle;  // The middle one, of which six triangles have a corner.
  const LensMesh mesh = lattice_mesh(starts, landings, 3, 3, 1);
  ASSERT_EQ(mesh.mesh.triangles.size(), 2u);
  std::vector<Sheet> sheets;
  const SheetSearch search(mesh, 1);
  search.find({1.1, -1.1}, sheets);
  EXPECT_TRUE(sheets.empty());
  search.find({0.1, -0.1}, sheets);
  EXPECT_EQ(sheets.size(), 1u);
}

TEST(LensMesh, SheetsOfAFoldedStrip) {
  // x lands at 1 − |x − 1|: a strip that is folded onto itself at x = 1. The two halves have different lengths of path.
  std::vector<Vector2d> starts;
  std::vector<LensLanding> landings;
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 3; ++x) {
      starts.emplace_back(x, y);
      landings.push_back(landing_at({1 - std::abs(x - 1), y}, 10 + x));
      landings.back().jacobian(0, 0) = x == 0 ? 1 : x == 1 ? 0 : -1;
    }
  const LensMesh mesh = lattice_mesh(starts, landings, 3, 2, 1);
  ASSERT_EQ(mesh.mesh.triangles.size(), 4u);
  const SheetSearch search(mesh, 1);
  std::vector<Sheet> sheets;
  search.find({0.25, 0.4}, sheets);
  ASSERT_EQ(sheets.size(), 2u);
  std::sort(sheets.begin(), sheets.end(), [](const Sheet& a, const Sheet& b) { return a.start.x() < b.start.x(); });
  for (int i = 0; i < 2; ++i) {
    const double x = i == 0 ? 0.25 : 1.75;
    EXPECT_LT((sheets[i].start - Vector2d(x, 0.4)).norm(), 1e-12);
    EXPECT_NEAR(sheets[i].length, 10 + x, 1e-12);
    EXPECT_NEAR(sheets[i].jacobian(0, 0), 1 - x, 1e-12);
    EXPECT_NEAR(sheets[i].jacobian(1, 1), 1, 1e-12);
  }
  search.find({0.5, 0.5}, sheets);  // On the diagonal of both halves, where each still counts as one sheet.
  EXPECT_EQ(sheets.size(), 2u);
  search.find({1, 0.5}, sheets);  // On the fold, where both sheets meet.
  EXPECT_EQ(sheets.size(), 1u);
  search.find({1.01, 0.5}, sheets);
  EXPECT_TRUE(sheets.empty());
}

TEST(LensMesh, TheSameOnAnyNumberOfThreads) {
  const TensorField field = spreading_field();
  const LensMap map = make_map(field);
  const LensMeshSettings settings = mesh_settings(0.4, 2, 0.05);
  LensMesh meshes[2];
  TraceCounts counts[2];
  for (const std::size_t i : {0, 1}) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, i + 1);
    meshes[i] = make_lens_mesh(map, spreading_s, settings, counts[i], Progress());
  }
  EXPECT_EQ(meshes[0].starts, meshes[1].starts);
  EXPECT_EQ(meshes[0].mesh.vertices, meshes[1].mesh.vertices);
  EXPECT_EQ(meshes[0].mesh.triangles, meshes[1].mesh.triangles);
  EXPECT_EQ(counts[0].ray_steps, counts[1].ray_steps);
  EXPECT_EQ(counts[0].tensor_samples, counts[1].tensor_samples);
}

TEST(LensMesh, CanBeCancelled) {
  const TensorField field = spreading_field();
  const LensMap map = make_map(field);
  Progress progress;
  progress.cancelled = true;
  TraceCounts counts;
  EXPECT_THROW(make_lens_mesh(map, spreading_s, mesh_settings(0.4, 2, 0.05), counts, progress), Cancelled);
}

}  // namespace
}  // namespace tensorray
