#include "renderer/surfaces/tube_mesh.h"

#include <array>
#include <map>
#include <tuple>

#include "base/constants.h"
#include "tests/renderer/shapes.h"

namespace tensorray {
namespace {

/// A tube along z from 0 to `length`, with semi-axes a along x and b along y.
Tube straight_tube(double a, double b, double length, int points) {
  Tube tube;
  for (int i = 0; i < points; ++i) {
    const double t = double(i) / (points - 1);
    tube.push_back({{0, 0, length * t}, {a, 0, 0}, {0, b, 0}, t});
  }
  return tube;
}

/// An arc of radius 1 in the plane z = 0; the ellipses of its points are circles of radius r.
Tube arc(double r, double angle, int points) {
  Tube tube;
  for (int i = 0; i < points; ++i) {
    const double at = angle * i / (points - 1);
    const Vector3d outwards(std::cos(at), std::sin(at), 0);
    tube.push_back({outwards, r * Vector3d::UnitZ(), r * outwards, 0});
  }
  return tube;
}

/// A helix with an ellipse that rotates about it and changes its size.
Tube twisted_tube() {
  Tube tube;
  for (int i = 0; i <= 60; ++i) {
    const double at = 0.1 * i;
    const Vector3d direction = Vector3d(-std::sin(at), std::cos(at), 0.3).normalized();
    const Vector3d outwards(std::cos(at), std::sin(at), 0);
    const Eigen::AngleAxisd turn(3 * at, direction);
    const Vector3d x = turn * outwards, y = direction.cross(x);
    tube.push_back({outwards + 0.3 * at * Vector3d::UnitZ(), (0.1 + 0.005 * i) * x, 0.1 * y, at});
  }
  return tube;
}

TubeSettings settings_of(TubeStyle style, TubeCaps caps, double tolerance = 0, int max_segments = 64) {
  TubeSettings settings;
  settings.style = style;
  settings.caps = caps;
  settings.tolerance = tolerance;
  settings.max_segments = max_segments;
  return settings;
}

TubeMesh solid(const Tube& tube, TubeCaps caps = TubeCaps::flat, double tolerance = 0, int max_segments = 64) {
  return make_tube_mesh({tube}, settings_of(TubeStyle::solid, caps, tolerance, max_segments));
}

/// Makes its ellipse larger.
void scale(TubePoint& point, double factor) {
  point.x *= factor;
  point.y *= factor;
}

/// Vertices are identified by their positions, which are equal to the last bit where caps meet sides.
struct Edges {
  int open = 0;            ///< Those that do not occur just once in each direction.
  int characteristic = 0;  ///< Euler characteristic: vertices − edges + triangles.
};

Edges edges_of(const TriangleMesh& mesh) {
  std::map<std::tuple<double, double, double>, int> numbers;
  const auto number = [&](std::uint32_t vertex) {
    const Vector3d& p = mesh.vertices[vertex];
    return numbers.emplace(std::tuple(p.x(), p.y(), p.z()), int(numbers.size())).first->second;
  };
  std::map<std::pair<int, int>, std::array<int, 2>> edges;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const int a = number(t[i]), b = number(t[(i + 1) % 3]);
      ++edges[{std::min(a, b), std::max(a, b)}][a < b];
    }
  Edges result;
  for (const auto& [edge, counts] : edges) result.open += counts != std::array{1, 1};
  result.characteristic = int(numbers.size()) - int(edges.size()) + int(mesh.triangles.size());
  return result;
}

/// Each vertex has a unit normal that points outwards, as its triangles do.
void expect_normals_outwards(const TubeMesh& tubes) {
  ASSERT_EQ(tubes.normals.size(), tubes.mesh.vertices.size());
  ASSERT_EQ(tubes.values.size(), tubes.mesh.vertices.size());
  for (const Vector3f& normal : tubes.normals) EXPECT_NEAR(normal.norm(), 1, 1e-5);
  for (const auto& t : tubes.mesh.triangles) {
    const Vector3d &a = tubes.mesh.vertices[t[0]], &b = tubes.mesh.vertices[t[1]], &c = tubes.mesh.vertices[t[2]];
    const Vector3d face = (b - a).cross(c - a);
    EXPECT_GT(face.norm(), 0);
    for (const std::uint32_t vertex : t) EXPECT_GT(face.normalized().dot(tubes.normals[vertex].cast<double>()), 0);
  }
}

void expect_watertight(const TubeMesh& tubes, int characteristic) {
  const Edges edges = edges_of(tubes.mesh);
  EXPECT_EQ(edges.open, 0);
  EXPECT_EQ(edges.characteristic, characteristic);
  expect_normals_outwards(tubes);
}

TEST(TubeMesh, AStraightTubeHasItsVolume) {
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    const double a = 0.5, b = 0.2, length = 3;
    const TubeMesh tubes = solid(straight_tube(a, b, length, 10), TubeCaps::flat, tolerance);
    // A polygon of n corners on a circle covers n sin(2π/n) / (2π) of the area of the circle. The same holds for its
    // affine image. n is the smallest number that keeps the sagitta a (1 − cos(π/n)) within the tolerance.
    const double n = std::max(6.0, std::ceil(pi / std::acos(1 - tolerance / a)));
    EXPECT_NEAR(volume(tubes.mesh), pi * a * b * length * n * std::sin(2 * pi / n) / (2 * pi), 1e-12) << n;
    // Two triangles per side of the only segment, and the fans of the caps; the value is linear along it, so two rings
    // suffice.
    EXPECT_EQ(tubes.mesh.triangles.size(), std::size_t(2 * n + 2 * (n - 2)));
    expect_watertight(tubes, 2);
  }
}

TEST(TubeMesh, CurvedAndTwistedTubesAreWatertight) {
  for (const Tube& tube : {twisted_tube(), arc(0.2, 2, 5), straight_tube(1, 0.1, 2, 3)})
    for (const TubeCaps caps : {TubeCaps::flat, TubeCaps::round}) {
      const TubeMesh tubes = solid(tube, caps);
      expect_watertight(tubes, 2);
      EXPECT_GT(volume(tubes.mesh), 0);
    }
  EXPECT_GT(edges_of(solid(twisted_tube(), TubeCaps::open).mesh).open, 0);
}

TEST(TubeMesh, RoundCapsAreHalfBalls) {
  const double r = 0.4, length = 2;
  const TubeMesh tubes = solid(straight_tube(r, r, length, 2), TubeCaps::round, 1e-4, 200);
  // The inscribed surface is off by up to the tolerance, in a dome by up to twice the tolerance.
  EXPECT_NEAR(volume(tubes.mesh), pi * r * r * length + 4.0 / 3 * pi * r * r * r,
              2e-4 * (2 * pi * r * length + 4 * pi * r * r));
  EXPECT_NEAR(tubes.mesh.bounds().max().z(), length + r, 1e-12);
  EXPECT_NEAR(tubes.mesh.bounds().min().z(), -r, 1e-12);
  for (std::size_t i = 0; i < tubes.normals.size(); ++i) {
    const Vector3d& p = tubes.mesh.vertices[i];
    const Vector3d center(0, 0, std::clamp(p.z(), 0.0, length));
    EXPECT_GT(tubes.normals[i].cast<double>().dot((p - center).normalized()), 0.999);
  }
}

TEST(TubeMesh, RingsAreAddedWhereATubeBends) {
  // A bend given by only four points: a quarter of a torus of radius 1 and tube radius 0.25.
  const double r = 0.25, exact = pi / 2 * pi * r * r;
  double last = 1;
  for (const double tolerance : {0.02, 0.002, 0.0002}) {
    const TubeMesh tubes = solid(arc(r, pi / 2, 4), TubeCaps::flat, tolerance, 400);
    const double error = std::abs(volume(tubes.mesh) - exact);
    // The side is off by the tolerance.
    EXPECT_LT(error, tolerance * 2 * pi * r * pi / 2);
    EXPECT_LT(error, last);
    last = error;
    for (const Vector3d& p : tubes.mesh.vertices)
      EXPECT_NEAR((p - Vector3d(p.x(), p.y(), 0).normalized()).norm(), r, tolerance);
  }
  EXPECT_GT(solid(arc(r, pi / 2, 4), TubeCaps::flat, 0.0002).mesh.triangles.size(),
            4 * solid(arc(r, pi / 2, 4), TubeCaps::flat, 0.02).mesh.triangles.size());
}

TEST(TubeMesh, WidthsBetweenPointsAreSmooth) {
  // A tube that swells, given by a few points: widths are off by the third power of their distance, not the second.
  const auto radius = [](double z) { return 0.1 + 0.05 * std::tanh(3 * z - 1); };
  const auto greatest_error = [&](int points) {
    Tube tube = straight_tube(1, 1, 1, points);
    for (TubePoint& point : tube) scale(point, radius(point.center.z()));
    double error = 0;
    const TriangleMesh mesh = solid(tube, TubeCaps::open, 1e-6).mesh;
    for (const auto& t : mesh.triangles) {
      // The side from a ring to the next one that runs along the tube.
      const Vector3d middle = (mesh.vertices[t[0]] + mesh.vertices[t[2]]) / 2;
      const bool runs_along = std::abs(mesh.vertices[t[0]].cross(mesh.vertices[t[2]]).z()) < 1e-9;
      if (runs_along) error = std::max(error, std::abs(middle.head<2>().norm() - radius(middle.z())));
    }
    return error;
  };
  EXPECT_LT(greatest_error(9), 2e-4);
  EXPECT_GT(std::log2(greatest_error(17) / greatest_error(33)), 2.7);
}

TEST(TubeMesh, WidthsDoNotOvershoot) {
  Tube tube = straight_tube(0.1, 0.1, 1, 11);
  for (std::size_t i = 5; i < tube.size(); ++i) scale(tube[i], 9);
  for (const Vector3d& p : solid(tube, TubeCaps::open, 1e-4).mesh.vertices) {
    EXPECT_GT(p.head<2>().norm(), 0.1 - 1e-12);
    EXPECT_LT(p.head<2>().norm(), 0.9 + 1e-12);
  }
}

TEST(TubeMesh, RingsThatOthersImplyAreLeftOutButValuesAreKept) {
  Tube tube = straight_tube(0.1, 0.1, 1, 1001);
  const std::size_t plain = solid(tube).mesh.vertices.size();
  EXPECT_EQ(plain, solid(straight_tube(0.1, 0.1, 1, 2)).mesh.vertices.size());
  for (TubePoint& point : tube) point.value = point.center.z() < 0.4 ? 0 : 1;
  const TubeMesh stepped = solid(tube);
  // Two more rings than the plain tube, which has two rings and two caps.
  EXPECT_EQ(stepped.mesh.vertices.size(), 2 * plain - 2 * plain / 4);
  for (std::size_t i = 0; i < stepped.values.size(); ++i)
    EXPECT_EQ(stepped.values[i], stepped.mesh.vertices[i].z() < 0.3995 ? 0 : 1);
}

TEST(TubeMesh, NormalsFollowATaper) {
  Tube cone = straight_tube(0.5, 0.5, 1, 2);
  scale(cone[1], 0.2);
  const double slope = std::atan(0.4);
  for (const Vector3f& normal : solid(cone, TubeCaps::open).normals) EXPECT_NEAR(normal.z(), std::sin(slope), 1e-6);
}

TEST(TubeMesh, WiresAreHoopsAndLines) {
  TubeSettings settings = settings_of(TubeStyle::wire, TubeCaps::flat);
  settings.spacing = 0.5;
  settings.wire_radius = 0.01;
  settings.lines = 0;
  const Tube tube = straight_tube(0.3, 0.2, 2, 2);
  const TubeMesh hoops = make_tube_mesh({tube}, settings);
  expect_watertight(hoops, 0);  // Five tori.
  const double h = std::pow((0.3 - 0.2) / (0.3 + 0.2), 2);
  const double perimeter = pi * (0.3 + 0.2) * (1 + 3 * h / (10 + std::sqrt(4 - 3 * h)));  // Ramanujan 1914.
  // A hexagon, the coarsest polygon, has 0.83 of the area of its circle.
  EXPECT_LT(volume(hoops.mesh), 5 * perimeter * pi * 1e-4);
  EXPECT_GT(volume(hoops.mesh), 0.8 * 5 * perimeter * pi * 1e-4);

  settings.lines = 4;
  const TubeMesh both = make_tube_mesh({tube}, settings);
  expect_watertight(both, 8);
  EXPECT_LT(volume(both.mesh) - volume(hoops.mesh), 4 * 2 * pi * 1e-4);
  EXPECT_GT(volume(both.mesh) - volume(hoops.mesh), 0.8 * 4 * 2 * pi * 1e-4);
  // On the tube, up to the radius of the wire and the sagitta of the polygons.
  for (const Vector3d& p : both.mesh.vertices) EXPECT_NEAR(std::hypot(p.x() / 0.3, p.y() / 0.2), 1, 0.011 / 0.2 + 0.05);
  expect_normals_outwards(make_tube_mesh({twisted_tube()}, settings_of(TubeStyle::wire, TubeCaps::flat)));
}

TEST(TubeMesh, DiscsAreSeparateEllipses) {
  TubeSettings settings = settings_of(TubeStyle::discs, TubeCaps::flat, 1e-4, 200);
  settings.spacing = 0.5;
  settings.thickness = 0.02;
  const TubeMesh discs = make_tube_mesh({straight_tube(0.3, 0.2, 2, 3)}, settings);
  expect_watertight(discs, 2 * 5);
  EXPECT_NEAR(volume(discs.mesh), 5 * pi * 0.3 * 0.2 * 0.02, 5 * 2 * pi * 0.3 * 0.02 * 1e-4);
  for (std::size_t i = 0; i < discs.values.size(); ++i)
    EXPECT_NEAR(discs.values[i], discs.mesh.vertices[i].z() / 2, 0.0051);
}

TEST(TubeMesh, TubesAreNumberedAndEmptyOnesAllowed) {
  const Tube tube = straight_tube(0.3, 0.2, 2, 3);
  const TubeMesh one = solid(tube);
  const TubeMesh tubes =
      make_tube_mesh({tube, {}, tube, {tube[0]}}, settings_of(TubeStyle::solid, TubeCaps::flat, 0.3 / 50));
  const auto n = static_cast<std::uint32_t>(one.mesh.triangles.size());
  EXPECT_THAT(tubes.tube_ends, ElementsAre(n, n, 2 * n, 2 * n));
  EXPECT_NEAR(volume(tubes.mesh), 2 * volume(one.mesh), 1e-12);
  EXPECT_TRUE(make_tube_mesh({}, {}).mesh.triangles.empty());
}

TEST(TubeMesh, TubesOfSeveralChunksAreJoinedInOrder) {
  const std::size_t count = 20000;
  const Tube tube = straight_tube(0.3, 0.2, 2, 2);
  std::vector<Tube> tubes(count, tube);
  for (std::size_t i = 0; i < count; ++i)
    for (TubePoint& point : tubes[i]) point.value = double(i);
  const TubeMesh mesh = make_tube_mesh(tubes, settings_of(TubeStyle::solid, TubeCaps::open, 0.3));
  ASSERT_EQ(mesh.mesh.triangles.size(), 12 * count);
  ASSERT_EQ(mesh.mesh.vertices.size(), 12 * count);
  EXPECT_EQ(mesh.mesh.vertices.capacity(), 12 * count);
  for (std::size_t i = 0; i < count; ++i) {
    ASSERT_EQ(mesh.tube_ends[i], 12 * (i + 1));
    for (const std::uint32_t vertex : mesh.mesh.triangles[12 * i]) ASSERT_EQ(mesh.values[vertex], float(i));
  }
}

TEST(TubeMesh, TheNumberOfTrianglesIsBounded) {
  const Tube tube = straight_tube(0.3, 0.2, 2, 2);
  for (const TubeStyle style : {TubeStyle::solid, TubeStyle::wire, TubeStyle::discs}) {
    TubeSettings settings = settings_of(style, TubeCaps::flat);
    const std::size_t needed = make_tube_mesh({tube, tube}, settings).mesh.triangles.size();
    settings.max_triangles = needed;
    EXPECT_EQ(make_tube_mesh({tube, tube}, settings).mesh.triangles.size(), needed);
    settings.max_triangles = needed - 1;
    EXPECT_THROW(make_tube_mesh({tube, tube}, settings), std::runtime_error);
  }
  // The settings must be refused at once: building the mesh would take weeks.
  TubeSettings settings = settings_of(TubeStyle::discs, TubeCaps::flat);
  settings.spacing = 1e-15;
  EXPECT_THROW(make_tube_mesh({tube}, settings), std::runtime_error);
  // However small the tolerance is, a solid tube has 64 rings for each of its points.
  EXPECT_LE(solid(arc(0.2, 2, 5), TubeCaps::open, 1e-300).mesh.vertices.size(), 5u * 64 * 64);
}

}  // namespace
}  // namespace tensorray
