#include "tracing/bending/geometry.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include <tbb/parallel_for.h>

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

using Crossings = std::vector<TriangleCrossing>;

std::vector<const TriangleMesh*> meshes(const std::vector<Part>& parts) {
  std::vector<const TriangleMesh*> result;
  for (const Part& part : parts) result.push_back(part.mesh);
  return result;
}

/// The triangles of all parts, each larger by `margin` on all sides.
TriangleMesh grown(const std::vector<Part>& parts, double margin) {
  TriangleMesh result;
  for (const Part& part : parts)
    for (const auto& [i, j, k] : part.mesh->triangles) {
      const auto& at = part.mesh->vertices;
      const Eigen::Vector3d middle = (at[i] + at[j] + at[k]) / 3;
      const double longest = std::max({(at[j] - at[i]).norm(), (at[k] - at[j]).norm(), (at[i] - at[k]).norm()});
      const double to_edge = (at[j] - at[i]).cross(at[k] - at[i]).norm() / longest / 3;
      if (!(to_edge > 0)) continue;  // Nothing meets it.
      const double factor = 1 + (margin < 1e3 * to_edge ? margin / to_edge : 1e3);
      const auto first = static_cast<std::uint32_t>(result.vertices.size());
      for (const std::uint32_t corner : {i, j, k}) result.vertices.push_back(middle + factor * (at[corner] - middle));
      result.triangles.push_back({first, first + 1, first + 2});
    }
  return result;
}

/// Some meshes in a separate scene. A query names a group, because some builds of Embree have no ray masks.
struct Group {
  Group(std::vector<Part> meshes_and_surfaces, const Eigen::Vector3d& origin, double unit)
      : parts(std::move(meshes_and_surfaces)), scene(meshes(parts), origin, unit) {
    for (const Part& part : parts) boxes.push_back(part.mesh->bounds());
    const TriangleMesh larger = grown(parts, relative_margin * unit);
    grown_scene = TriangleScene({&larger}, origin, unit);
  }

  std::vector<Part> parts;
  std::vector<Eigen::AlignedBox3d> boxes;       // Bounding boxes of the parts.
  TriangleScene scene, grown_scene{{}, {}, 1};  // The second finds what the first does, whatever rounding does.
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
        absorbers(absorber_parts(), volume.center(), size) {
    cut_is_plain = find_whether_plain();
  }

  Surfaces surfaces;
  TriangleMesh receiver;
  Eigen::AlignedBox3d volume;
  double size, margin;
  // The scenes' coordinates are relative to the volume, so that single precision resolves it well.
  Group bounds, cut, absorbers;
  bool cut_is_plain = false;  // Whether all of the cut separates inside from outside.

  /// Whether light that crosses the cut here crosses it in and out in turn, at places in no doubt.
  bool alternate(const Crossings& all) const {
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double apart =
          i == 0 ? infinite : (all[i].distance - all[i - 1].distance) * (all[i].sign != all[i - 1].sign);
      if (!all[i].is_clear || apart <= margin) return false;
    }
    return true;
  }

  /// By a line through each triangle; a mesh of very many counts as not plain, which is slower and as right.
  bool find_whether_plain() const {
    constexpr std::size_t most = 1 << 20;
    if (!surfaces.cut || surfaces.cut->triangles.size() > most) return false;
    const TriangleMesh& mesh = *surfaces.cut;
    const double far = 1.1 * cut.boxes[0].diagonal().norm();
    std::atomic<bool> is_plain{true};
    tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t i) {
      if (!is_plain) return;
      Crossings all;
      const auto& [a, b, c] = mesh.triangles[i];
      const Eigen::Vector3d middle = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3;
      const auto is_plain_along = [&](const auto& direction) {
        cross_cut(middle, direction, -far, far, all);
        return all.size() >= 2 && all.front().sign < 0 && all.back().sign > 0 && alternate(all);
      };
      if (std::none_of(generic_directions.begin(), generic_directions.end(), is_plain_along)) is_plain = false;
    });
    return is_plain;
  }

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
    return exact(group, from, direction, *seen);
  }

  /// The hit of a triangle, its distance in double precision. @param seen  What the group's scene has found.
  template <class Seen>
  Hit exact(const Group& group, const Eigen::Vector3d& from, const Eigen::Vector3d& direction, const Seen& seen) const {
    const Part& part = group.parts[seen.mesh];
    const auto& triangle = part.mesh->triangles[seen.triangle];
    const Eigen::Vector3d& a = part.mesh->vertices[triangle[0]];
    const Eigen::Vector3d& b = part.mesh->vertices[triangle[1]];
    const Eigen::Vector3d& c = part.mesh->vertices[triangle[2]];
    Hit hit;
    hit.surface = part.surface;
    hit.normal = (b - a).cross(c - a).normalized();
    const double exact = hit.normal.dot(a - from) / hit.normal.dot(direction);
    // Where a ray grazes a plane, the distance to the plane is ill-conditioned: keep the distance from Embree.
    const double allowed = 10 * (margin + relative_margin * std::abs(seen.distance));
    hit.distance = std::abs(exact - seen.distance) <= allowed ? exact : seen.distance;
    return hit;
  }

  /// Sets `crossings` to those of a line with the cut, from the first to the last.
  void cross_cut(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double min_distance,
                 double max_distance, Crossings& crossings) const {
    cut.scene.crossings(from, direction, min_distance, max_distance, crossings);
    for (TriangleCrossing& crossing : crossings) crossing.distance = exact(cut, from, direction, crossing).distance;
    std::sort(crossings.begin(), crossings.end(), [](const TriangleCrossing& a, const TriangleCrossing& b) {
      return std::tie(a.distance, a.mesh, a.triangle) < std::tie(b.distance, b.mesh, b.triangle);
    });
  }

  /// Whether light is inside the cut beyond some of its crossings, those from `first` to before `last`, which count as
  /// one.
  /// @param crossings  All of the light.
  bool is_inside_beyond(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, const Crossings& crossings,
                        std::size_t first, std::size_t last) const {
    if (last == crossings.size()) return false;  // It would not leave.
    int count = 0, inside = 0;
    bool is_clear = true;
    for (std::size_t i = crossings.size(); i-- > first;) {
      count += crossings[i].sign;
      if (i >= last) inside = count;
      is_clear = is_clear && crossings[i].is_clear && count >= 0;
    }
    if (is_clear) return inside > 0;
    const double at = last > first ? crossings[last - 1].distance : 0;
    return is_inside(from + (at + crossings[last].distance) / 2 * direction);  // Farthest from what is crossed.
  }

  /// Whether the cut surrounds a point. On the skin it does not: there is nothing on one of its sides.
  bool is_inside(const Eigen::Vector3d& point) const {
    bool is_known = false;
    for (const Eigen::Vector3d& direction : generic_directions)
      for (const double sense : {1.0, -1.0}) {
        Crossings crossings;
        cross_cut(point, sense * direction, 0.3 * margin, infinite, crossings);
        int count = 0;
        bool is_clear = true;
        for (const TriangleCrossing& crossing : crossings) {
          count += crossing.sign;
          is_clear = is_clear && crossing.is_clear;
        }
        if (is_clear && count <= 0) return false;
        is_known = is_known || is_clear;
      }
    return is_known;
  }

  /// Where light leaves the bounds, by the planes of their triangles.
  std::optional<Hit> exit_of_bounds(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                    double max_distance) const {
    constexpr double min_slope = 1e-12;
    Hit exit{infinite, Surface::bounds, Eigen::Vector3d::Zero()};
    for (std::uint32_t i = 0; i < surfaces.bounds.triangles.size(); ++i) {
      const Hit hit = exact(bounds, from, direction, TriangleHit{infinite, 0, i});
      if (hit.normal.dot(direction) > min_slope && hit.distance < exit.distance) exit = hit;
    }
    exit.distance = std::max(exit.distance, 0.0);
    if (!(exit.distance <= max_distance)) return std::nullopt;
    return exit;
  }

  /// `Geometry::crossing` of the cut.
  std::optional<Hit> cut_crossing(bool inwards, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                  double max_distance) const {
    thread_local Crossings all;
    cross_cut(from, direction, -margin, max_distance + margin, all);
    const auto may_count = [&](const TriangleCrossing& crossing) {
      return (crossing.sign < 0) == inwards && crossing.distance <= max_distance;
    };
    const auto met = std::find_if(all.begin(), all.end(), may_count);
    if (met == all.end()) return std::nullopt;
    const auto hit_of = [&](const TriangleCrossing& crossing) {
      Hit hit = exact(cut, from, direction, crossing);
      hit.distance = std::max(hit.distance, 0.0);
      return hit;
    };
    if (cut_is_plain && alternate(all)) return hit_of(*met);
    cross_cut(from, direction, -margin, infinite, all);
    for (std::size_t first = 0, last = 0; first < all.size(); first = last) {
      for (last = first + 1; last < all.size() && all[last].distance - all[last - 1].distance <= margin;) ++last;
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
      const auto end = all.begin() + static_cast<std::ptrdiff_t>(last), found = std::find_if(begin, end, may_count);
      if (found != end && is_inside_beyond(from, direction, all, first, last) == inwards) return hit_of(*found);
    }
    return std::nullopt;
  }

  /// `Geometry::cut_ahead`.
  CutAhead ahead(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
    if (cut_is_plain) {
      const auto next = cut.scene.nearest(from, direction, margin, infinite);
      if (!next) return {};
      const Hit hit = exact(cut, from, direction, *next);
      const double slope = hit.normal.dot(direction);
      if (next->is_clear && slope > 1e-6) return {true, std::nullopt};
      if (next->is_clear && slope < -1e-6) return {false, hit};
    }
    thread_local Crossings all;
    cross_cut(from, direction, -margin, infinite, all);
    std::size_t here = 0;
    while (here < all.size() && all[here].distance <= margin) ++here;
    if (is_inside_beyond(from, direction, all, 0, here)) return {true, std::nullopt};
    return {false, cut_crossing(true, from, direction, infinite)};
  }
};

const std::array<Eigen::Vector3d, 3> Geometry::generic_directions{
    Eigen::Vector3d(0.5381, 0.3127, 0.7827).normalized(), Eigen::Vector3d(-0.2713, 0.8461, 0.4589).normalized(),
    Eigen::Vector3d(0.7193, -0.4397, -0.5378).normalized()};

Geometry::Geometry(Surfaces surfaces) : state_(std::make_unique<State>(std::move(surfaces))) {}
Geometry::~Geometry() = default;
Geometry::Geometry(Geometry&&) noexcept = default;
Geometry& Geometry::operator=(Geometry&&) noexcept = default;

double Geometry::margin() const { return state_->margin; }

const Surfaces& Geometry::surfaces() const { return state_->surfaces; }

std::optional<Hit> Geometry::absorber(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                      double max_distance) const {
  if (max_distance < infinite && !may_absorb(origin, origin + max_distance * direction)) return std::nullopt;
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

std::uint32_t Geometry::may_meet(const Segment* ways, int count) const {
  const double margin = 2 * state_->margin;
  std::uint32_t near = 0;
  for (int i = 0; i < count; ++i) near |= may_absorb(ways[i].from, ways[i].to) ? 1u << i : 0;
  if (near != 0) near &= state_->absorbers.grown_scene.met(ways, count, margin, false);
  return near | state_->cut.grown_scene.met(ways, count, margin, true);
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
  if (surface == Surface::cut) return state_->cut_crossing(inwards, origin, direction, max_distance);
  // A line crosses a convex mesh once in each sense, where two triangles may meet. Along a face, rounding may show it
  // the face again and again.
  constexpr int max_crossings = 8;
  double from = -state_->margin;
  for (int i = 0; i < max_crossings; ++i) {
    auto hit = state_->nearest(state_->bounds, origin, direction, from, max_distance + state_->margin);
    if (!hit || hit->distance > max_distance) return std::nullopt;
    if ((hit->normal.dot(direction) < 0) == inwards) {
      hit->distance = std::max(hit->distance, 0.0);
      return hit;
    }
    const double next = std::max(hit->distance, from) + state_->margin;
    if (!(next > from)) return std::nullopt;  // Double precision does not resolve the margin at this distance.
    from = next;
  }
  return inwards ? std::nullopt : state_->exit_of_bounds(origin, direction, max_distance);
}

CutAhead Geometry::cut_ahead(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {
  return has_cut() ? state_->ahead(point, direction) : CutAhead{true, std::nullopt};
}

}  // namespace tensorray
