#pragma once
/// Small fields and scenes for the tests of the integrators.

#include <functional>

#include "renderer/meshes/mesh.h"
#include "tests/names.h"
#include "tracing/bending/bending.h"
#include "tracing/trace/trace.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {
namespace test {}
using namespace test;
}  // namespace tensorray

namespace tensorray::test {

/// The accepted difference of `trace` from exact arithmetic, in the units of these fields, whose edges are 2: half a
/// unit in the last place of single precision, for each of about ten steps.
constexpr double single_precision = 5e-7;

using TensorFunction = std::function<Matrix3d(const Vector3d&)>;

/// A grid of `voxels` centres along each axis of the cube [-1, 1]³, moved by `placement`; `tensor` takes world
/// positions.
inline TensorGrid cube_grid(const Vector3i& voxels, const TensorFunction& tensor,
                            const Affine3d& placement = Affine3d::Identity()) {
  const Vector3d edges = 2 / (voxels.array() - 1).cast<double>();
  const Affine3d to_world = placement * Eigen::Translation3d(-1, -1, -1) * Eigen::Scaling(edges);
  return dense_grid(AlignedBox3i(Vector3i::Zero(), Vector3i(voxels.array() - 1)), to_world,
                    [&](const Vector3i& index) { return tensor(to_world * index.cast<double>()); });
}

inline TensorField cube_field(int voxels, const TensorFunction& tensor,
                              const Affine3d& placement = Affine3d::Identity()) {
  return TensorField(cube_grid(Vector3i::Constant(voxels), tensor, placement));
}

inline TensorField constant_field(const Matrix3d& tensor) {
  return cube_field(9, [&](const Vector3d&) { return tensor; });
}

/// The edge of a voxel, world units, of a field whose voxels are cubes.
inline double voxel_size(const TensorField& field) { return field.to_world().linear().col(0).norm(); }

inline Surfaces surfaces_of(const TensorField& field) {
  Surfaces surfaces;
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  return surfaces;
}

inline Geometry geometry_with(const TensorField& field, const Plate& plate) {
  Surfaces surfaces = surfaces_of(field);
  surfaces.plate = plate;
  return Geometry(std::move(surfaces));
}

inline TriangleMesh box_between(const Vector3d& low, const Vector3d& high,
                                const Affine3d& placement = Affine3d::Identity()) {
  return box_mesh(AlignedBox3d(low, high), placement);
}

/// Surfaces that are a box: an obstacle, or the cut.
inline Surfaces obstacle_between(const Vector3d& low, const Vector3d& high) {
  Surfaces surfaces;
  surfaces.obstacles = {box_between(low, high)};
  return surfaces;
}
inline Surfaces cut_between(const Vector3d& low, const Vector3d& high) {
  Surfaces surfaces;
  surfaces.cut = box_between(low, high);
  return surfaces;
}

inline TriangleMesh joined(const std::vector<TriangleMesh>& parts) {
  TriangleMesh all;
  for (const TriangleMesh& part : parts) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles) all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return all;
}

/// A large plate at `distance` from the origin along `direction`, across it.
inline Plate plate_across(const Vector3d& direction, double distance) {
  Plate plate;
  const Vector3d normal = -direction.normalized();
  plate.center = -distance * normal;
  plate.up = upright(normal, Vector3d::UnitY());
  plate.right = plate.up.cross(normal);
  plate.size = {40, 40};
  return plate;
}

struct Ray {
  Vector3d position, direction;
  RayEnd end = RayEnd::missed;
  std::uint32_t steps = 0;
  double length = 0;
};

/// Traces with the reference: these tests check its mathematics in double precision, and packet_kernel_test.cpp
/// compares `trace` with it.
inline Ray trace_one(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                     const Vector3d& position, const Vector3d& direction, double flexibility) {
  RayBatch batch;
  batch.add(position, direction.normalized(), flexibility);
  trace_reference(field, geometry, settings, batch);
  Ray ray{batch.position[0], batch.direction[0]};
  ray.end = batch.end[0];
  ray.steps = batch.steps[0];
  ray.length = batch.length[0];
  return ray;
}

/// One step of the classical Runge–Kutta method for P' = V, V' = s (T V − (VᵀTV) V).
inline Ray stepped(const TensorFunction& T, double s, const Ray& ray, double h) {
  const auto bend = [&](const Vector3d& at, const Vector3d& v) {
    const Vector3d Tv = T(at) * v;
    return Vector3d(s * (Tv - v.dot(Tv) / v.squaredNorm() * v));
  };
  const Vector3d &P = ray.position, &V = ray.direction;
  const Vector3d k1 = bend(P, V), v2 = V + h / 2 * k1, k2 = bend(P + h / 2 * V, v2), v3 = V + h / 2 * k2,
                 k3 = bend(P + h / 2 * v2, v3), v4 = V + h * k3, k4 = bend(P + h * v3, v4);
  return {P + h / 6 * (V + 2 * v2 + 2 * v3 + v4), (V + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)).normalized()};
}

/// A ray through a formula, in steps far below what tests measure.
inline Ray through_formula(const TensorFunction& T, double s, const Vector3d& P, const Vector3d& V, double length) {
  constexpr int steps = 4000;
  Ray ray{P, V};
  for (int i = 0; i < steps; ++i) ray = stepped(T, s, ray, length / steps);
  return ray;
}

/// All points of a ray.
inline PathPoints points_of(const TensorField& field, const RayRecord& record) {
  PathPoints points;
  for (std::size_t i = 0; i < record.size(); ++i) points.push_back(path_point(field, record, i));
  return points;
}

inline BendingSettings settings_of(BendingMethod method, double step) {
  BendingSettings settings;
  settings.method = method;
  settings.step = step;
  return settings;
}

/// A tensor without any symmetry, its entries short binary fractions, so that single precision holds them exactly.
inline Matrix3d general_tensor() {
  Matrix3d T;
  T << 0.5, -1.25, 0.375, 0.75, -0.5, 1.0, -0.25, 0.625, 0.25;
  return T;
}

/// A field that is linear in position, which trilinear interpolation reproduces exactly: smooth data on a grid.
inline Matrix3d linear_tensor(const Vector3d& p) {
  Matrix3d x, y, z;
  x << 0.5, 0.25, -0.75, 1.0, 0.25, 0.5, -0.5, 0.125, 0.75;
  y << -0.25, 0.5, 0.5, -0.75, 1.0, 0.25, 0.25, -0.5, 0.5;
  z << 0.75, -0.5, 0.25, 0.5, -0.25, 1.0, 1.25, 0.25, -0.5;
  return general_tensor() + p.x() * x + p.y() * y + p.z() * z;
}

/// Smooth; it focuses and turns light.
inline Matrix3d focusing_tensor(const Vector3d& p) {
  Matrix3d T;
  T << 0.4 * p.x(), 0.1, -p.x(), 0, 0.5, -0.8 * p.y(), 0.5 - p.x(), -p.y(), -0.3;
  return T;
}

}  // namespace tensorray::test
