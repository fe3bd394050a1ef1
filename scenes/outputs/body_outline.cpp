#include "scenes/outputs/body_outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "renderer/surfaces/surface_scene.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Place = std::array<double, 3>;

constexpr double same_place = 1e-8;       // Of the size of a mesh.
constexpr double feature_cosine = 0.866;  // Of 30°.
constexpr double along_view = 1e-3;       // Sine of the angle that rounding makes of faces that the view grazes.
constexpr double piece_length = 2;        // Pixels; what hides a line is looked for in the middle of each piece.
constexpr double most_pieces = 4096;
constexpr double off = 1e-4;  // Distance from a body at which the view begins, of the size of all.

struct BodyEdge {
  Vector3d from, to;
  std::vector<Vector3d> normals;  ///< Of its faces.
};

/// By the places of their ends: vertices at one place are one, as meshes may have one for each triangle.
std::map<std::pair<Place, Place>, BodyEdge> edges_of(const TriangleMesh& mesh) {
  const double grid = same_place * mesh.bounds().diagonal().norm();
  const auto place_of = [&](const Vector3d& at) {
    return Place{std::round(at.x() / grid), std::round(at.y() / grid), std::round(at.z() / grid)};
  };
  std::map<std::pair<Place, Place>, BodyEdge> edges;
  for (const auto& triangle : mesh.triangles) {
    const auto corner = [&](std::size_t i) { return mesh.vertices[triangle[i % 3]]; };
    const Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).stableNormalized();
    for (std::size_t i = 0; i < 3; ++i) {
      const Place from = place_of(corner(i)), to = place_of(corner(i + 1));
      if (from == to) continue;
      BodyEdge& edge = edges[std::minmax(from, to)];
      edge.from = corner(i);
      edge.to = corner(i + 1);
      edge.normals.push_back(normal);
    }
  }
  return edges;
}

/// @param normals  Changed. @param towards  To the viewer.
bool is_drawn(std::vector<Vector3d>& normals, const Vector3d& towards) {
  const auto normal = [&](std::size_t i) { return normals.begin() + static_cast<std::ptrdiff_t>(i); };
  for (std::size_t i = 0; normals.size() > 2 && i < normals.size();) {  // Faces that lie on each other do not count.
    const auto opposite = std::find_if(normal(i + 1), normals.end(),
                                       [&](const Vector3d& other) { return (normals[i] + other).norm() < along_view; });
    if (opposite == normals.end()) {
      ++i;
      continue;
    }
    normals.erase(opposite);
    normals.erase(normal(i));
  }
  if (std::count(normals.begin(), normals.end(), Vector3d(0, 0, 0)) > 0) return false;  // A triangle without an area.
  if (normals.size() < 2) return !normals.empty();
  const double a = normals[0].dot(towards), b = normals[1].dot(towards);
  return normals[0].dot(normals[1]) < feature_cosine || ((a > 0) != (b > 0) && std::abs(a - b) > along_view);
}

}  // namespace

std::vector<OutlineStroke> body_outline(const std::vector<TriangleMesh>& bodies, const Plate& plate,
                                        const Vector3d& direction) {
  std::vector<ShadedSurface> surfaces(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) surfaces[i].shape = bodies[i];
  const SurfaceScene stage(std::move(surfaces));
  const Vector3d normal = plate.normal(), towards = direction.normalized() * (direction.dot(normal) > 0 ? 1 : -1);
  const auto pixel_of = [&](const Vector3d& point) {
    return plate.to_pixel(point + normal.dot(plate.center - point) / normal.dot(towards) * towards);
  };
  std::vector<OutlineStroke> strokes;
  const auto add = [&](const BodyEdge& edge, const Vector3d& outwards) {
    const Vector2d begin = pixel_of(edge.from), way = pixel_of(edge.to) - begin;
    const Eigen::AlignedBox2d line(begin.cwiseMin(begin + way), begin.cwiseMax(begin + way));
    if (!line.intersects({Vector2d(0, 0), plate.resolution.cast<double>()})) return;
    const double count = std::clamp(std::ceil(way.norm() / piece_length), 1.0, most_pieces);
    for (double i = 0; i < count; ++i) {
      const Vector3d middle = edge.from + (i + 0.5) / count * (edge.to - edge.from);
      const Vector3d start = middle + off * stage.bounds().diagonal().norm() * (outwards + towards);
      const bool is_hidden = stage.occluded(start, towards);
      if (i == 0 || strokes.back().is_hidden != is_hidden) strokes.push_back({begin + i / count * way, {}, is_hidden});
      strokes.back().to = begin + (i + 1) / count * way;
    }
  };
  for (const TriangleMesh& body : bodies)
    for (auto& [places, edge] : edges_of(body))
      if (is_drawn(edge.normals, towards))
        add(edge, std::accumulate(edge.normals.begin(), edge.normals.end(), Vector3d(0, 0, 0)).normalized());
  return strokes;
}

std::vector<OutlineStroke> body_outline(const Scene& scene, const Plate& plate) {
  const OutputDescription& output = scene.description.output;
  if (!output.wants(Annotation::body) && !output.wants(Annotation::hidden)) return {};
  std::vector<TriangleMesh> bodies = scene.geometry.surfaces().obstacles;
  if (scene.geometry.has_cut()) bodies.push_back(*scene.geometry.surfaces().cut);
  return body_outline(bodies, plate, scene.beam.direction);
}

}  // namespace tensorray
