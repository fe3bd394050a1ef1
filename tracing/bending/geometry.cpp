#include "tracing/bending/geometry.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "renderer/surfaces/triangle_scene.h"

namespace tensorray {
namespace {

constexpr double relative_margin = 1e-6;  // Of the volume's size; single precision resolves a tenth of it.

/// What collects light; empty if nothing does.
TriangleMesh receiver_mesh(const Surfaces& surfaces) {
  if (surfaces.body) return *surfaces.body;
  if (surfaces.plate) return {surfaces.plate->corners(), {{0, 1, 2}, {0, 2, 3}}};
  return {};
}

struct Part {
  const TriangleMesh* mesh;  // In double precision; the scene has a copy in single precision.
  Surface surface;
};

std::vector<const TriangleMesh*> meshes(const std::vector<Part>& parts) {
  std::vector<const TriangleMesh*> result;
  for (const Part& part : parts) result.push_back(part.mesh);
  return result;
}

/// Some meshes in a separate scene. A query names a group, because some builds of Embree have no ray masks.
struct Group {
  Group(std::vector<Part> meshes_and_surfaces, const Eigen::Vector3d& origin, double unit)
      : parts(std::move(meshes_and_surfaces)), scene(meshes(parts), origin, unit) {
    for (const Part& part : parts) boxes.push_back(part.mesh->bounds());
  }

  std::vector<Part> parts;
  std::vector<Eigen::AlignedBox3d> boxes;  // Bounding boxes of the parts.
  TriangleScene scene;
};

}  // namespace

struct Geometry::State {
  explicit State(Surfaces parts)
      : surfaces(std::move(parts)),
        receiver(receiver_mesh(surfaces)),
        volume(surfaces.bounds.bounds()),
        size(volume.diagonal().norm()),
        margin(relative_margin * size),
        bounds({{&surfaces.bounds, Surface::bounds}}, volume.center(), size),
        cut(cut_parts(), volume.center(), size),
        absorbers(absorber_parts(), volume.center(), size) {}

  Surfaces surfaces;
  TriangleMesh receiver;
  Eigen::AlignedBox3d volume;
  double size, margin;
  // The scenes' coordinates are relative to the volume, so that single precision resolves it well.
  Group bounds, cut, absorbers;

  /// @throw std::invalid_argument if single precision does not reach the mesh.
  Part part_of(const TriangleMesh& mesh, Surface surface, const std::string& name) const {
    const double reach = TriangleScene::reach * size;
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      if (!((vertex - volume.center()).array().abs() <= reach).all())
        throw std::invalid_argument(name + " is more than 1e12 times the volume's size away from the volume, which " +
                                    "is beyond single precision; move it nearer, or check its units");
    return {&mesh, surface};
  }

  std::vector<Part> cut_parts() const {
    if (!surfaces.cut) return {};
    return {part_of(*surfaces.cut, Surface::cut, "the mesh that cuts the volume")};
  }

  std::vector<Part> absorber_parts() const {
    std::vector<Part> parts;
    if (!receiver.triangles.empty()) parts.push_back(part_of(receiver, Surface::plate, "the receiver"));
    for (std::size_t i = 0; i < surfaces.obstacles.size(); ++i)
      parts.push_back(part_of(surfaces.obstacles[i], Surface::obstacle, "obstacle " + std::to_string(i)));
    return parts;
  }

  /// The nearest hit of a group at more than `min_distance` (which may be negative).
  std::optional<Hit> nearest(const Group& group, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                             double min_distance, double max_distance) const {
    const auto seen = group.scene.nearest(from, direction, min_distance, max_distance);
    if (!seen) return std::nullopt;
    const Part& part = group.parts[seen->mesh];
    const auto& triangle = part.mesh->triangles[seen->triangle];
    const Eigen::Vector3d& a = part.mesh->vertices[triangle[0]];
    const Eigen::Vector3d& b = part.mesh->vertices[triangle[1]];
    const Eigen::Vector3d& c = part.mesh->vertices[triangle[2]];
    Hit hit;
    hit.surface = part.surface;
    hit.normal = (b - a).cross(c - a).normalized();
    const double exact = hit.normal.dot(a - from) / hit.normal.dot(direction);
    // Where a ray grazes a plane, the distance to the plane is ill-conditioned: keep the distance from Embree.
    const double allowed = 10 * (margin + relative_margin * std::abs(seen->distance));
    hit.distance = std::abs(exact - seen->distance) <= allowed ? exact : seen->distance;
    return hit;
  }
};

Geometry::Geometry(Surfaces surfaces) : state_(std::make_unique<State>(std::move(surfaces))) {}
Geometry::~Geometry() = default;
Geometry::Geometry(Geometry&&) noexcept = default;
Geometry& Geometry::operator=(Geometry&&) noexcept = default;

double Geometry::margin() const { return state_->margin; }

const Surfaces& Geometry::surfaces() const { return state_->surfaces; }

std::optional<Hit> Geometry::absorber(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                      double max_distance) const {
  auto hit = state_->nearest(state_->absorbers, origin, direction, -state_->margin, max_distance + state_->margin);
  if (!hit || hit->distance > max_distance) return std::nullopt;
  hit->distance = std::max(hit->distance, 0.0);
  return hit;
}

bool Geometry::may_absorb(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::Array3d low = from.cwiseMin(to).array() - state_->margin,
                       high = from.cwiseMax(to).array() + state_->margin;
  const std::vector<Eigen::AlignedBox3d>& boxes = state_->absorbers.boxes;
  return std::any_of(boxes.begin(), boxes.end(), [&](const Eigen::AlignedBox3d& box) {
    return (low <= box.max().array()).all() && (high >= box.min().array()).all();
  });
}

Eigen::AlignedBox3d Geometry::absorbers_within(const Eigen::AlignedBox3d& region) const {
  Eigen::AlignedBox3d all;
  for (const Eigen::AlignedBox3d& box : state_->absorbers.boxes) {
    const Eigen::AlignedBox3d common = box.intersection(region);
    if (!common.isEmpty()) all.extend(common);
  }
  return all;
}

std::optional<Hit> Geometry::crossing(Surface surface, bool inwards, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double max_distance) const {
  const Group& group = surface == Surface::bounds ? state_->bounds : state_->cut;
  constexpr int max_crossings = 10000;  // Of one line with one mesh; rounding must not make this loop endless.
  double from = -state_->margin;
  for (int i = 0; i < max_crossings; ++i) {
    auto hit = state_->nearest(group, origin, direction, from, max_distance + state_->margin);
    if (!hit || hit->distance > max_distance) return std::nullopt;
    if ((hit->normal.dot(direction) < 0) == inwards) {
      hit->distance = std::max(hit->distance, 0.0);
      return hit;
    }
    const double next = std::max(hit->distance, from) + state_->margin;
    if (!(next > from)) break;  // Double precision does not resolve the margin at this distance.
    from = next;
  }
  return std::nullopt;
}

bool Geometry::inside_cut(const Eigen::Vector3d& point) const {
  if (!has_cut()) return true;
  // From inside a closed mesh, a ray in any direction meets the first surface from behind. This direction is unlikely
  // to meet an edge.
  const Eigen::Vector3d direction = Eigen::Vector3d(0.5381, 0.3127, 0.7827).normalized();
  const auto hit = state_->nearest(state_->cut, point, direction, 0, infinite);
  return hit && hit->normal.dot(direction) > 0;
}

}  // namespace tensorray
