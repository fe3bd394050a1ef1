#include "renderer/geometry.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <stdexcept>
#include <string>

namespace tensorray {
namespace {

constexpr double tolerance = 1e-6;  // Of the volume's size: what single precision resolves, with some room.

/// Hides the difference between Embree 3 and 4.
void intersect(RTCScene scene, RTCRayHit& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

TriangleMesh plate_mesh(const Plate& plate) { return {plate.corners(), {{0, 1, 2}, {0, 2, 3}}}; }

/// One mesh, kept in double precision beside Embree's copy.
struct Part {
  TriangleMesh mesh;
  Surface surface;
};

/// Some meshes in a scene of their own: queries name a group, as ray masks are not in every build of Embree.
struct Group {
  std::vector<Part> parts;  // By Embree's geometry number.
  Eigen::AlignedBox3d box;
  RTCScene scene = nullptr;
};

void check(RTCDevice device) {
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot build the scene (error " + std::to_string(error) + ")");
}

void attach(RTCDevice device, Group& group, const Eigen::Vector3d& origin, double unit) {
  group.scene = rtcNewScene(device);
  rtcSetSceneFlags(group.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(group.scene, RTC_BUILD_QUALITY_HIGH);
  for (const Part& part : group.parts) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), part.mesh.vertices.size()));
    auto* triangles = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), part.mesh.triangles.size()));
    check(device);
    for (const Eigen::Vector3d& vertex : part.mesh.vertices)
      for (int axis = 0; axis < 3; ++axis) *vertices++ = static_cast<float>((vertex[axis] - origin[axis]) / unit);
    for (const auto& triangle : part.mesh.triangles) triangles = std::copy(triangle.begin(), triangle.end(), triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(group.scene, geometry);
    rtcReleaseGeometry(geometry);
    group.box.extend(part.mesh.bounds());
  }
  rtcCommitScene(group.scene);
  check(device);
}

}  // namespace

struct Geometry::State {
  Surfaces surfaces;
  RTCDevice device = nullptr;
  Group bounds, cut, absorbers;
  // Embree's frame, so that its single precision is spent on the volume, whatever the world's units.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double unit = 1;
  double margin = 0;

  ~State() {
    for (const Group* group : {&bounds, &cut, &absorbers})
      if (group->scene) rtcReleaseScene(group->scene);
    if (device) rtcReleaseDevice(device);
  }

  /// The nearest hit of a group beyond `min_distance` (which may be negative).
  std::optional<Hit> nearest(const Group& group, const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                             double min_distance, double max_distance) const;
};

Geometry::Geometry(Surfaces surfaces) : state_(std::make_unique<State>()) {
  State& state = *state_;
  state.surfaces = std::move(surfaces);
  state.bounds.parts.push_back({state.surfaces.bounds, Surface::bounds});
  if (state.surfaces.cut) state.cut.parts.push_back({*state.surfaces.cut, Surface::cut});
  if (state.surfaces.plate) state.absorbers.parts.push_back({plate_mesh(*state.surfaces.plate), Surface::plate});
  for (const TriangleMesh& mesh : state.surfaces.obstacles) state.absorbers.parts.push_back({mesh, Surface::obstacle});

  const Eigen::AlignedBox3d volume = state.surfaces.bounds.bounds();
  state.origin = volume.center();
  state.unit = volume.diagonal().norm();
  state.margin = tolerance * state.unit;

  state.device = rtcNewDevice(nullptr);
  if (!state.device) throw std::runtime_error("Embree cannot start on this processor");
  for (Group* group : {&state.bounds, &state.cut, &state.absorbers})
    attach(state.device, *group, state.origin, state.unit);
}

Geometry::~Geometry() = default;
Geometry::Geometry(Geometry&&) noexcept = default;
Geometry& Geometry::operator=(Geometry&&) noexcept = default;

const Surfaces& Geometry::surfaces() const { return state_->surfaces; }

std::optional<Hit> Geometry::State::nearest(const Group& group, const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& direction, double min_distance,
                                            double max_distance) const {
  if (group.parts.empty()) return std::nullopt;
  // Embree sees no hits behind a ray's origin, so that the ray starts at `min_distance`.
  const Eigen::Vector3d start = (from + min_distance * direction - origin) / unit;
  RTCRayHit ray{};
  ray.ray.org_x = static_cast<float>(start.x());
  ray.ray.org_y = static_cast<float>(start.y());
  ray.ray.org_z = static_cast<float>(start.z());
  ray.ray.dir_x = static_cast<float>(direction.x());
  ray.ray.dir_y = static_cast<float>(direction.y());
  ray.ray.dir_z = static_cast<float>(direction.z());
  ray.ray.tfar = static_cast<float>((max_distance - min_distance) / unit);
  ray.ray.mask = 0xffffffffu;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  tensorray::intersect(group.scene, ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const Part& part = group.parts[ray.hit.geomID];
  const auto& triangle = part.mesh.triangles[ray.hit.primID];
  const Eigen::Vector3d& a = part.mesh.vertices[triangle[0]];
  const Eigen::Vector3d& b = part.mesh.vertices[triangle[1]];
  const Eigen::Vector3d& c = part.mesh.vertices[triangle[2]];
  Hit hit;
  hit.surface = part.surface;
  hit.normal = (b - a).cross(c - a).normalized();
  const double seen = min_distance + ray.ray.tfar * unit;
  const double exact = hit.normal.dot(a - from) / hit.normal.dot(direction);
  // Where light grazes a plane the distance to it is ill-determined: keep what Embree saw.
  hit.distance = std::abs(exact - seen) <= 10 * (margin + tolerance * std::abs(seen)) ? exact : seen;
  return hit;
}

std::optional<Hit> Geometry::absorber(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                      double max_distance) const {
  auto hit = state_->nearest(state_->absorbers, origin, direction, -state_->margin, max_distance + state_->margin);
  if (!hit || hit->distance > max_distance) return std::nullopt;
  hit->distance = std::max(hit->distance, 0.0);
  return hit;
}

bool Geometry::may_absorb(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::AlignedBox3d& box = state_->absorbers.box;
  return (from.cwiseMin(to).array() <= box.max().array() + state_->margin).all() &&
         (from.cwiseMax(to).array() >= box.min().array() - state_->margin).all();
}

std::optional<Hit> Geometry::crossing(Surface surface, bool inwards, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double max_distance) const {
  const Group& group = surface == Surface::bounds ? state_->bounds : state_->cut;
  constexpr int most_crossings = 10000;  // Of one line and one mesh: rounding shall not keep it here for ever.
  double from = -state_->margin;
  for (int i = 0; i < most_crossings; ++i) {
    auto hit = state_->nearest(group, origin, direction, from, max_distance + state_->margin);
    if (!hit || hit->distance > max_distance) return std::nullopt;
    if ((hit->normal.dot(direction) < 0) == inwards) {
      hit->distance = std::max(hit->distance, 0.0);
      return hit;
    }
    from = std::max(hit->distance, from) + state_->margin;
  }
  return std::nullopt;
}

bool Geometry::inside_cut(const Eigen::Vector3d& point) const {
  if (!has_cut()) return true;
  // From inside a closed mesh the first surface along any direction is met from behind. This direction is unlikely to
  // meet an edge.
  const Eigen::Vector3d direction = Eigen::Vector3d(0.5381, 0.3127, 0.7827).normalized();
  const auto hit = state_->nearest(state_->cut, point, direction, 0, infinite);
  return hit && hit->normal.dot(direction) > 0;
}

}  // namespace tensorray
