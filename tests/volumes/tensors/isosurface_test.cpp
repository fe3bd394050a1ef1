#include "volumes/tensors/isosurface.h"

#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

const Vector3d center(0.11, -0.07, 0.05);

/// T = |P − c| I: its greatest eigenvalue is the distance from c.
TensorField distance_field(const Eigen::AlignedBox3i& box, const Eigen::Affine3d& to_world) {
  return TensorField(dense_grid(box, to_world, [&](const Vector3i& index) {
    const double distance = (to_world * index.cast<double>() - center).norm();
    return Eigen::Matrix3d(distance * Eigen::Matrix3d::Identity());
  }));
}

/// The cube from −1 to 1 with 2 n + 1 voxels along an edge.
TensorField cube(int n) {
  return distance_field({Vector3i::Constant(-n), Vector3i::Constant(n)}, Eigen::Affine3d(Eigen::Scaling(1.0 / n)));
}

using Triangle = std::array<std::uint32_t, 3>;

Vector3d area_vector(const Isosurface& surface, const Triangle& t) {
  const Vector3d& a = surface.mesh.vertices[t[0]];
  return (surface.mesh.vertices[t[1]] - a).cross(surface.mesh.vertices[t[2]] - a) / 2;
}

double area(const Isosurface& surface) {
  double sum = 0;
  for (const Triangle& triangle : surface.mesh.triangles) sum += area_vector(surface, triangle).norm();
  return sum;
}

double max_radius_error(const Isosurface& surface, double radius) {
  double error = 0;
  for (const Vector3d& vertex : surface.mesh.vertices)
    error = std::max(error, std::abs((vertex - center).norm() - radius));
  return error;
}

/// Edges that belong to one triangle only, in the direction of the triangle.
int open_edges(const Isosurface& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const Triangle& t : surface.mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      ++uses[{t[i], t[(i + 1) % 3]}];
      --uses[{t[(i + 1) % 3], t[i]}];
    }
  int open = 0;
  for (const auto& [edge, balance] : uses) open += balance > 0;
  return open;
}

/// Smaller values are inside: triangles and normals face the middle.
void expect_inwards(const Isosurface& surface, double tolerance) {
  ASSERT_EQ(surface.normals.size(), surface.mesh.vertices.size());
  for (const Triangle& t : surface.mesh.triangles)
    EXPECT_GE(area_vector(surface, t).dot(center - surface.mesh.vertices[t[0]]), 0);
  for (std::size_t i = 0; i < surface.mesh.vertices.size(); ++i)
    EXPECT_LT((surface.normals[i] - (center - surface.mesh.vertices[i]).normalized()).norm(), tolerance);
}

TEST(IsosurfaceTest, SphereOfSecondOrder) {
  constexpr double radius = 0.6, exact = 4 * pi * radius * radius;
  double radius_error[2], area_error[2];
  for (int i = 0; i < 2; ++i) {
    const int n = 8 << i;
    const double h = 1.0 / n;
    const Isosurface surface = isosurface(cube(n), Invariant::largest_eigenvalue, radius);
    EXPECT_EQ(open_edges(surface), 0);
    expect_inwards(surface, 2 * h * h / (radius * radius));
    radius_error[i] = max_radius_error(surface, radius);
    area_error[i] = std::abs(area(surface) - exact);
    EXPECT_LT(radius_error[i], h * h / radius);
    EXPECT_LT(area_error[i], exact * 2 * h * h / (radius * radius));
  }
  EXPECT_LT(radius_error[1], radius_error[0] / 3);
  EXPECT_LT(area_error[1], area_error[0] / 3);
}

TEST(IsosurfaceTest, AnyAffineTransform) {
  Eigen::Affine3d to_world = Eigen::Affine3d::Identity();
  to_world.translate(Vector3d(0.1, 0, -0.1)).rotate(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()));
  to_world.scale(Vector3d(0.05, 0.08, 0.04));
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(0, 1) = 0.3;
  to_world.linear() *= shear;
  Eigen::Affine3d mirrored = to_world;
  mirrored.linear().col(1) *= -1;
  for (const Eigen::Affine3d& transform : {to_world, mirrored}) {
    const TensorField field = distance_field({Vector3i::Constant(-30), Vector3i::Constant(30)}, transform);
    const Isosurface surface = isosurface(field, Invariant::largest_eigenvalue, 0.7);
    EXPECT_EQ(open_edges(surface), 0);
    EXPECT_LT(max_radius_error(surface, 0.7), 0.08 * 0.08 / 0.7);
    EXPECT_NEAR(area(surface), 4 * pi * 0.49, 4 * pi * 0.49 * 2 * 0.0064 / 0.49);
    expect_inwards(surface, 0.05);
  }
}

/// A sphere that extends beyond the extent is cut off there and has no caps. The rest has the area by Archimedes.
TEST(IsosurfaceTest, IsOpenAtTheFacesOfTheExtentAndEndsOnThem) {
  const int n = 16;
  const Eigen::AlignedBox3i box(Vector3i(-n, -n, -n), Vector3i(4, n, n));
  const TensorField field = distance_field(box, Eigen::Affine3d(Eigen::Scaling(1.0 / n)));
  const Isosurface surface = isosurface(field, Invariant::largest_eigenvalue, 0.6);
  double furthest = -1;
  for (const Vector3d& vertex : surface.mesh.vertices) furthest = std::max(furthest, vertex.x());
  EXPECT_EQ(furthest, 0.25);
  EXPECT_GT(open_edges(surface), 40);
  const double exact = 2 * pi * 0.6 * (0.25 - center.x() + 0.6);
  EXPECT_NEAR(area(surface), exact, exact * 0.02);
  EXPECT_LT(max_radius_error(surface, 0.6), 0.5 / n);
}

/// Missing voxels are zero, far from the faces of the extent: a block has a surface half a voxel outside it.
TEST(IsosurfaceTest, InactiveVoxelsCountAsZero) {
  TensorGrid grid = dense_grid({Vector3i(-4, 12, -4), Vector3i(4, 20, 4)}, Eigen::Affine3d::Identity(),
                               [](const Vector3i&) { return Eigen::Matrix3d(2 * Eigen::Matrix3d::Identity()); });
  for (const int at : {-100, 100}) {
    const TensorGrid far =
        dense_grid({Vector3i::Constant(at), Vector3i::Constant(at)}, Eigen::Affine3d::Identity(),
                   [](const Vector3i&) { return Eigen::Matrix3d(0.5 * Eigen::Matrix3d::Identity()); });
    grid.blocks.insert(at < 0 ? grid.blocks.begin() : grid.blocks.end(), far.blocks.begin(), far.blocks.end());
  }
  const Isosurface surface = isosurface(TensorField(grid), Invariant::trace, 3);
  EXPECT_EQ(open_edges(surface), 0);
  const Eigen::AlignedBox3d box = surface.mesh.bounds();
  EXPECT_LT((box.min() - Vector3d(-4.5, 11.5, -4.5)).norm(), 1e-5);
  EXPECT_LT((box.max() - Vector3d(4.5, 20.5, 4.5)).norm(), 1e-5);
  for (const Triangle& t : surface.mesh.triangles)
    EXPECT_GT(area_vector(surface, t).dot(surface.mesh.vertices[t[0]] - Vector3d(0, 16, 0)), 0);
}

TEST(IsosurfaceTest, EmptyWhereNothingIsOnTheOtherSide) {
  for (const double value : {-1.0, 9.0}) {
    const Isosurface surface = isosurface(cube(4), Invariant::largest_eigenvalue, value);
    EXPECT_TRUE(surface.mesh.triangles.empty()) << value;
    EXPECT_TRUE(surface.mesh.vertices.empty()) << value;
  }
}

TEST(IsosurfaceTest, RefusesWhatHasNoSurface) {
  EXPECT_THROW(isosurface(cube(2), Invariant::norm, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  const TensorField flat = distance_field({Vector3i(0, 0, 0), Vector3i(4, 4, 0)}, Eigen::Affine3d::Identity());
  EXPECT_THROW(isosurface(flat, Invariant::norm, 1), std::invalid_argument);
}

}  // namespace
}  // namespace tensorray
