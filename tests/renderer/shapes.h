#pragma once
/// Surfaces, and what is known of them in closed form.

#include <utility>

#include "base/constants.h"
#include "base/geometry/box.h"
#include "renderer/surfaces/surface.h"
#include "tests/names.h"

namespace tensorray {

inline ShadedSurface surface_of(TriangleMesh mesh, int material = 0, int light = -1) {
  ShadedSurface surface;
  surface.shape = std::move(mesh);
  surface.material = material;
  surface.light = light;
  return surface;
}

/// A sphere of radius 1 with smooth normals.
inline ShadedSurface sphere(int rings) {
  TriangleMesh mesh;
  std::vector<Vector3f> normals;
  const auto around = static_cast<std::uint32_t>(2 * rings);
  for (int ring = 0; ring <= rings; ++ring)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double polar = pi * ring / rings, turn = 2 * pi * i / around;
      const double radius = ring % rings == 0 ? 0 : std::sin(polar);  // All corners at a pole are at one place.
      mesh.vertices.emplace_back(radius * std::cos(turn), radius * std::sin(turn), std::cos(polar));
      normals.push_back(mesh.vertices.back().cast<float>());
    }
  for (std::uint32_t ring = 0; ring < static_cast<std::uint32_t>(rings); ++ring)
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t a = ring * around + i, b = ring * around + (i + 1) % around;
      if (ring > 0) mesh.triangles.push_back({a, a + around, b});
      if (ring + 1 < static_cast<std::uint32_t>(rings)) mesh.triangles.push_back({a + around, b + around, b});
    }
  ShadedSurface surface = surface_of(std::move(mesh));
  surface.normals = std::move(normals);
  return surface;
}

/// That a closed mesh encloses; positive if its triangles face outwards.
inline double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  return sum;
}

/// Distance at which a straight ray enters a box about the origin: 0 if it starts inside, infinite if it misses it.
inline double box_entry(const Vector3d& half_size, const Vector3d& origin, const Vector3d& direction) {
  double enters = 0, leaves = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-half_size[axis] - origin[axis]) / direction[axis];
    const double b = (half_size[axis] - origin[axis]) / direction[axis];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return leaves > enters ? enters : INFINITY;
}

/// Lambert's formula (Schröder and Hanrahan 1993, "On the Form Factor Between Two Polygons"): the irradiance from a
/// polygon of radiance 1 that is completely above the horizon of the surface.
inline double polygon_irradiance(const std::vector<Vector3d>& polygon, const Vector3d& point, const Vector3d& normal) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d a = (polygon[i] - point).normalized();
    const Vector3d b = (polygon[(i + 1) % polygon.size()] - point).normalized();
    sum += std::acos(a.dot(b)) * a.cross(b).normalized().dot(normal) / 2;
  }
  return std::abs(sum);
}

}  // namespace tensorray
