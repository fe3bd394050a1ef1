#include "renderer/coverage/area_deposit.h"

#include <array>
#include <functional>
#include <numeric>
#include <random>

#include "renderer/coverage/planar_mesh.h"
#include "tests/names.h"

namespace tensorray {
namespace {

using Corners = std::array<Vector2d, 3>;

constexpr int width = 13, height = 9;

/// The sums of all deposits, row by row.
std::vector<double> pixels_of(const std::vector<AreaDeposit*>& deposits, int first_row = 0, int end_row = height) {
  for (AreaDeposit* deposit : deposits) deposit->flush();
  std::vector<double> pixels(static_cast<std::size_t>(width * (end_row - first_row)));
  for (int y = first_row; y < end_row; ++y)
    AreaDeposit::read_row({deposits.begin(), deposits.end()}, y, 0, &pixels[(y - first_row) * width]);
  return pixels;
}

/// Adds a triangle that has no neighbours.
void add_triangle(AreaDeposit& deposit, const Corners& corners, double power) {
  const auto& [a, b, c] = corners;
  const double density = deposit.triangle(a, b, c, power);
  if (density == 0) return;
  deposit.add_edge(a, b, density);
  deposit.add_edge(b, c, density);
  deposit.add_edge(c, a, density);
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

double uniform(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Vector2d uniform(std::mt19937& random, const Vector2d& low, const Vector2d& high) {
  return {uniform(random, low.x(), high.x()), uniform(random, low.y(), high.y())};
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
  for (const auto& [axis, limit] : {std::pair(0, x), {1, y}})
    part = clipped(clipped(part, axis, 1, limit), axis, -1, limit + 1);
  return area(part);
}

Corners random_triangle(std::mt19937& engine, double size) {
  const Vector2d middle = uniform(engine, {-4, -7}, {17, 14});
  Corners corners;
  for (Vector2d& corner : corners) corner = middle + uniform(engine, {-size, -size}, {size, size});
  return corners;
}

TEST(AreaDeposit, EachPixelGetsTheAreaThatItShares) {
  std::mt19937 engine(1);
  for (const double size : {0.2, 1.0, 4.0, 30.0})
    for (int i = 0; i < 300; ++i) {
      const Corners corners = random_triangle(engine, size);
      const double all = area({corners.begin(), corners.end()});
      if (all < 1e-3) continue;
      AreaDeposit deposit(width, height);
      add_triangle(deposit, corners, 0.5e-4);
      const std::vector<double> pixels = pixels_of({&deposit});
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          ASSERT_NEAR(pixels[static_cast<std::size_t>(y) * width + x], 0.5e-4 * area_in_pixel(corners, x, y) / all,
                      1e-13)
              << "size " << size << ", triangle " << i << ", pixel " << x << " " << y;
    }
}

/// Rows are the same, bit for bit, if a deposit keeps only some of them, and if several deposits share the triangles.
TEST(AreaDeposit, PartsAddUpToTheWhole) {
  std::mt19937 engine(6);
  AreaDeposit whole(width, height), first(width, height), second(width, height), middle(width, height, 3, 6);
  for (int i = 0; i < 400; ++i) {
    const Corners t = random_triangle(engine, i % 5 == 0 ? 8 : 1);
    for (AreaDeposit* deposit : {&whole, &middle, i % 3 == 0 ? &first : &second}) add_triangle(*deposit, t, 1e-5);
  }
  const std::vector<double> expected = pixels_of({&whole});
  EXPECT_EQ(pixels_of({&first, &second}), expected);
  EXPECT_THAT(pixels_of({&middle}, 3, 6), testing::ElementsAreArray(&expected[3 * width], 3 * width));
}

/// Rounding takes points of long edges over the borders of the plate.
TEST(AreaDeposit, EdgesMayBeLong) {
  std::mt19937 engine(9);
  const auto corner = [&](int i) {
    Vector2d place = uniform(engine, {0, -1e6}, {width, 1e6});
    if (i % 3 < 2) place.x() = i % 3 == 0 ? 0 : width;
    return place;
  };
  for (int i = 0; i < 3000; ++i) {
    const Corners t{corner(i), corner(i / 3), corner(i / 9)};
    AreaDeposit deposit(width, height);
    add_triangle(deposit, t, 1e-5);
    EXPECT_NEAR(sum(pixels_of({&deposit})) / 1e-5, part_on_plate(t[0], t[1], t[2], {width, height}), 1e-7)
        << i;  // Units of 2^-48.
  }
}

TEST(AreaDeposit, NoPowerIsLostWhereTrianglesHaveNoArea) {
  std::mt19937 engine(3);
  const Vector2d corner(width, height);
  for (const double thickness : {0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3})
    for (int i = 0; i < 300; ++i) {
      const Vector2d a = uniform(engine, {0, 0}, corner), b = uniform(engine, {0, 0}, corner);
      const Vector2d across = (b - a).unitOrthogonal();
      const Vector2d c = a + uniform(engine, 0, 1) * (b - a) + thickness * across;
      AreaDeposit deposit(width, height);
      add_triangle(deposit, {a, b, c.cwiseMax(0).cwiseMin(corner)}, 1);
      const std::vector<double> pixels = pixels_of({&deposit});
      ASSERT_NEAR(sum(pixels), 1, 1e-6) << thickness;
      ASSERT_GT(*std::min_element(pixels.begin(), pixels.end()), -1e-6) << thickness;
    }
  AreaDeposit deposit(width, height);
  const Vector2d point(2.5, 3.5);
  add_triangle(deposit, {point, point, point}, 1);
  EXPECT_EQ(pixels_of({&deposit})[3 * width + 2], 1);
}

/// The density along a triangle's longest side is that of the triangle, seen from the side.
TEST(AreaDeposit, LinesAreWhatThinTrianglesTendTo) {
  AreaDeposit line(width, height), thin(width, height);
  const Vector2d a(0.25, 4.5), b(12.5, 4.5), c(4, 4.5);
  add_triangle(line, {a, b, c}, 1e-3);
  add_triangle(thin, {a, b, c + Vector2d(0, 1e-3)}, 1e-3);
  EXPECT_THAT(pixels_of({&line}), testing::Pointwise(testing::DoubleNear(0.02e-3), pixels_of({&thin})));
}

/// A grid of cells x cells squares over [0, 1]², two triangles each. `map` moves the vertices.
PlanarMesh grid(std::uint32_t cells, const std::function<Vector2d(const Vector2d&)>& map) {
  PlanarMesh mesh;
  for (std::uint32_t y = 0; y <= cells; ++y)
    for (std::uint32_t x = 0; x <= cells; ++x) mesh.vertices.push_back(map(Vector2d(x, y) / cells));
  for (std::uint32_t y = 0; y < cells; ++y)
    for (std::uint32_t x = 0; x < cells; ++x) {
      const std::uint32_t corner = y * (cells + 1) + x, above = corner + cells + 1;
      mesh.triangles.push_back({corner, corner + 1, above});
      mesh.triangles.push_back({corner + 1, above + 1, above});
    }
  return mesh;
}

struct MeshSquare {
  const char* name;
  Vector2d offset;
  double scale;
};

const MeshSquare mesh_squares[] = {{"unit square", {0, 0}, 1},
                                   {"far away", {1000, -1000}, 1},
                                   {"small", {3e-20, 0}, 1e-20},
                                   {"large", {0, 1e20}, 1e20}};

/// A mesh of a square. Inner vertices are jittered, so that all triangles are different.
PlanarMesh jittered(std::uint32_t cells, std::mt19937& random, const MeshSquare& square) {
  return grid(cells, [&](Vector2d p) {
    for (double& coordinate : p)
      if (coordinate > 0 && coordinate < 1) coordinate += uniform(random, -0.2, 0.2) / cells;
    return Vector2d(square.offset + square.scale * p);
  });
}

std::vector<PlanarHit> hits_at(const PlanarMeshSearch& search, const Vector2d& point) {
  std::vector<PlanarHit> hits(1);  // `find` replaces what is there.
  search.find(point, hits);
  return hits;
}

std::vector<std::uint32_t> found(const PlanarMeshSearch& search, const Vector2d& point) {
  std::vector<std::uint32_t> result;
  for (const PlanarHit& hit : hits_at(search, point)) result.push_back(hit.triangle);
  return result;
}

/// Checks that the weights of each hit are those of the point.
void expect_weights(const PlanarMesh& mesh, const std::vector<PlanarHit>& hits, const Vector2d& point, double error) {
  for (const PlanarHit& hit : hits) {
    Vector2d place = Vector2d::Zero();
    for (int i = 0; i < 3; ++i) place += hit.weights[i] * mesh.vertices[mesh.triangles[hit.triangle][i]];
    EXPECT_GE(hit.weights.minCoeff(), 0);
    EXPECT_NEAR(hit.weights.sum(), 1, 1e-15);
    EXPECT_LT((place - point).norm(), error);
  }
}

std::vector<std::uint32_t> brute_force(const PlanarMesh& mesh, const Vector2d& point) {
  using Precise = Eigen::Matrix<long double, 2, 1>;
  std::vector<std::uint32_t> result;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    int left = 0, right = 0;
    for (int i = 0; i < 3; ++i) {
      const Precise start = mesh.vertices[mesh.triangles[t][i]].cast<long double>();
      const Precise edge = mesh.vertices[mesh.triangles[t][(i + 1) % 3]].cast<long double>() - start;
      const Precise to_point = point.cast<long double>() - start;
      const long double side = edge.x() * to_point.y() - edge.y() * to_point.x();
      left += side > 0;
      right += side < 0;
    }
    if (left == 3 || right == 3) result.push_back(t);
  }
  return result;
}

/// The triangles that contain all of these vertices.
std::vector<std::uint32_t> sharing(const PlanarMesh& mesh, const std::vector<std::uint32_t>& vertices) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (std::all_of(vertices.begin(), vertices.end(), [&](std::uint32_t vertex) {
          return std::count(mesh.triangles[t].begin(), mesh.triangles[t].end(), vertex) > 0;
        }))
      result.push_back(t);
  return result;
}

TEST(PlanarMesh, AgreesWithBruteForceWhereTrianglesOverlap) {
  std::mt19937 random(1);
  PlanarMesh mesh;  // Unconnected triangles of all sizes and both orientations.
  for (std::uint32_t i = 0; i < 600; ++i) {
    const double size = std::pow(10, uniform(random, -3, -0.5));
    const Vector2d center = uniform(random, {0, 0}, {1, 1});
    for (int corner = 0; corner < 3; ++corner)
      mesh.vertices.push_back(center + size * uniform(random, {-1, -1}, {1, 1}));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const PlanarMeshSearch search(mesh);
  std::size_t total = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector2d point = uniform(random, {-0.2, -0.2}, {1.2, 1.2});
    const std::vector<std::uint32_t> expected = brute_force(mesh, point);
    ASSERT_EQ(found(search, point), expected);
    expect_weights(mesh, hits_at(search, point), point, 1e-14);
    total += expected.size();
  }
  EXPECT_GT(total, 2000u);
}

TEST(PlanarMesh, PointsOnEdgesAndVerticesAreFoundInAllTrianglesThatShareThem) {
  for (const MeshSquare& square : mesh_squares) {
    SCOPED_TRACE(square.name);
    std::mt19937 random(3);
    const PlanarMesh mesh = jittered(40, random, square);
    const PlanarMeshSearch search(mesh);
    for (std::uint32_t vertex = 0; vertex < mesh.vertices.size(); ++vertex)
      ASSERT_EQ(found(search, mesh.vertices[vertex]), sharing(mesh, {vertex}));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t from = mesh.triangles[t][i], to = mesh.triangles[t][(i + 1) % 3];
        const Vector2d edge = mesh.vertices[to] - mesh.vertices[from];
        ASSERT_EQ(found(search, mesh.vertices[from] + uniform(random, 0.01, 0.99) * edge), sharing(mesh, {from, to}));
      }
  }
}

TEST(PlanarMesh, NoPointFallsBetweenTriangles) {
  for (const MeshSquare& square : mesh_squares) {
    SCOPED_TRACE(square.name);
    std::mt19937 random(4);
    const PlanarMesh mesh = jittered(300, random, square);
    const PlanarMeshSearch search(mesh);
    const Vector2d center = square.offset + Vector2d::Constant(square.scale / 2);
    for (int i = 0; i < 50000; ++i) {
      const auto& triangle = mesh.triangles[random() % mesh.triangles.size()];
      const Vector2d &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]];
      // Distance from an edge or a vertex, from below double precision to above single precision.
      const double away = square.scale * std::pow(10, uniform(random, -18, -5)),
                   along = i % 3 ? uniform(random, 0, 1) : 0;
      Vector2d point = a + along * (b - a) + away * uniform(random, {-1, -1}, {1, 1});
      point = point.cwiseMax(mesh.vertices.front()).cwiseMin(mesh.vertices.back());
      const std::vector<PlanarHit> hits = hits_at(search, point);
      ASSERT_GE(hits.size(), 1u) << (point - center).transpose();
      expect_weights(mesh, hits, point, 1e-14 * (center.norm() + square.scale));
    }
  }
}

TEST(PlanarMesh, TrianglesThinnerThanSinglePrecisionAreTold) {
  // Cells about 1e-10 wide, around x = 1/3.
  const std::uint32_t cells = 20;
  const PlanarMesh mesh = grid(cells, [](const Vector2d& p) {
    const double x = p.x() == 0 ? 0 : p.x() == 1 ? 1 : 1.0 / 3 + 2e-9 * (p.x() - 0.5);
    return Vector2d(x, p.y());
  });
  const PlanarMeshSearch search(mesh);
  std::mt19937 random(6);
  int on_edges = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector2d point(1.0 / 3 + uniform(random, -1e-9, 1e-9), uniform(random, 0, 1));
    const auto hits = found(search, point), expected = brute_force(mesh, point);
    ASSERT_TRUE(std::includes(hits.begin(), hits.end(), expected.begin(), expected.end()));
    on_edges += hits != expected;
  }
  // The rounding error is 1e-5 of a cell's width: about one in a thousand points is on an edge.
  EXPECT_LT(on_edges, 25);
}

TEST(PlanarMesh, ANeedleDoesNotReachBeyondItsTip) {
  for (const Vector2d& axis : {Vector2d(1, 0), Vector2d(0, 1), Vector2d(0.6, 0.8)}) {
    PlanarMesh mesh;
    const Vector2d across(-axis.y(), axis.x());
    mesh.vertices = {Vector2d::Zero(), axis, 0.5 * axis + 1e-14 * across, 2 * axis, across};
    mesh.triangles = {{0, 1, 2}, {1, 3, 4}};
    const PlanarMeshSearch search(mesh);
    EXPECT_EQ(found(search, 0.5 * axis), std::vector<std::uint32_t>{0});
    EXPECT_TRUE(found(search, -1e-6 * axis).empty());
    EXPECT_EQ(found(search, 1.1 * axis), std::vector<std::uint32_t>{1});
  }
}

TEST(PlanarMesh, DegenerateTrianglesAreNeverFound) {
  // Two triangles with one of zero area between them, one that is a point, and one with a repeated vertex.
  PlanarMesh mesh;
  mesh.vertices = {{0, 0}, {1, 1}, {0.25, 0.25}, {1, 0}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {2, 2, 2}, {0, 3, 1}, {0, 0, 1}, {0, 2, 4}, {2, 1, 4}};
  const PlanarMeshSearch search(mesh);
  EXPECT_EQ(found(search, {0.125, 0.125}), (std::vector<std::uint32_t>{2, 4}));
  EXPECT_EQ(found(search, {0.25, 0.25}), (std::vector<std::uint32_t>{2, 4, 5}));
  EXPECT_EQ(found(search, {0.5, 0.5}), (std::vector<std::uint32_t>{2, 5}));
}

TEST(PlanarMesh, NothingIsFoundOutsideOrInAnEmptyMesh) {
  PlanarMesh empty, point, square = grid(1, [](const Vector2d&p) { return p; });
  point.vertices = {{2, 3}};
  point.triangles = {{0, 0, 0}};
  square.vertices.emplace_back(NAN, INFINITY);  // Vertices that no triangle uses.
  for (const PlanarMesh* mesh : {&empty, &point, &square}) {
    const PlanarMeshSearch search(*mesh);
    for (const Vector2d& place : {Vector2d(2, 3), Vector2d(-1e-9, 0.5), Vector2d(0.5, 1 + 1e-9), Vector2d(1e300, 0),
                                  Vector2d(NAN, 0.5), Vector2d(INFINITY, 0)})
      EXPECT_TRUE(found(search, place).empty()) << place.transpose();
  }
  EXPECT_TRUE(found(PlanarMeshSearch(empty), Vector2d::Zero()).empty());
  EXPECT_EQ(found(PlanarMeshSearch(square), {0.9, 0.8}), std::vector<std::uint32_t>{1});
}

}  // namespace
}  // namespace tensorray
