#include "renderer/surfaces/triangle_scene.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include <Eigen/Geometry>

#include "base/geometry/box.h"
#include "renderer/surfaces/embree_handles.h"

namespace tensorray {
namespace {

using embree::check;
using embree::Owned;

constexpr float clear_of_edges = 1e-5f;  // Barycentric; Embree meets both triangles within 2e-7 of an edge.

bool is_clear(float u, float v) { return std::min({u, v, 1 - u - v}) > clear_of_edges; }

/// Sorts by mesh and triangle. Embree may report a triangle more than once if its search tree has split it.
template <class Triangle>
void sort_and_join(std::vector<Triangle>& triangles) {
  const auto key = [](const Triangle& id) { return std::tie(id.mesh, id.triangle); };
  const auto before = [&](const Triangle& a, const Triangle& b) { return key(a) < key(b); };
  const auto same = [&](const Triangle& a, const Triangle& b) { return key(a) == key(b); };
  std::sort(triangles.begin(), triangles.end(), before);
  triangles.erase(std::unique(triangles.begin(), triangles.end(), same), triangles.end());
}

bool add_candidate(RTCPointQueryFunctionArguments* arguments) {
  static_cast<std::vector<TriangleId>*>(arguments->userPtr)->push_back({arguments->geomID, arguments->primID});
  return false;  // The query's radius does not change.
}

/// Refuses triangles that are clearly met from outside.
void take_outwards(const RTCFilterFunctionNArguments* all) {
  for (unsigned i = 0; i < all->N; ++i) {
    if (all->valid[i] == 0) continue;
    const RTCRay ray = rtcGetRayFromRayN(all->ray, all->N, i);
    const RTCHit hit = rtcGetHitFromHitN(all->hit, all->N, i);
    const Eigen::Vector3f normal(hit.Ng_x, hit.Ng_y, hit.Ng_z), along(ray.dir_x, ray.dir_y, ray.dir_z);
    if (normal.dot(along) < -0.1f * normal.norm()) all->valid[i] = 0;
  }
}

}  // namespace

struct TriangleScene::State {
  Eigen::Vector3d origin;
  double unit;
  Eigen::AlignedBox3d box;  // Of the triangles, with a margin for single precision; empty if the mesh is planar.
  Owned<RTCDevice> device;
  Owned<RTCScene> scene;  // Null if there are no triangles.

  void start(RTCBuildQuality quality) {
    device = embree::make_device();
    scene.reset(rtcNewScene(device.get()));
    check(device.get());
    rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | embree::all_triangles_flag));
    rtcSetSceneBuildQuality(scene.get(), quality);
  }

  /// Vertices may have two or three coordinates.
  template <class Vertex>
  void attach(unsigned id, const std::vector<Vertex>& vertices,
              const std::vector<std::array<std::uint32_t, 3>>& triangles) {
    const Owned<RTCGeometry> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    check(device.get());
    auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices.size()));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles.size()));
    check(device.get());
    constexpr int axes = Vertex::RowsAtCompileTime;
    for (const Vertex& vertex : vertices) {
      for (int axis = 0; axis < axes; ++axis) *positions++ = local(vertex[axis], axis);
      if constexpr (axes == 2) *positions++ = 0;
    }
    for (const auto& triangle : triangles) indices = std::copy(triangle.begin(), triangle.end(), indices);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometryByID(scene.get(), geometry.get(), id);
    check(device.get());
  }

  void commit() {
    rtcCommitScene(scene.get());
    check(device.get());
  }

  void enclose(const std::vector<const TriangleMesh*>& meshes) {
    for (const TriangleMesh* mesh : meshes) box.extend(mesh->bounds());
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(unit + 1e-6 * (box.max() - box.min()).maxCoeff());
    box = {box.min() - margin, box.max() + margin};
  }

  float local(double coordinate, int axis) const { return static_cast<float>((coordinate - origin[axis]) / unit); }

  /// Whether single precision does not resolve the triangles from this point. NaN counts as far.
  bool is_far(const Eigen::Vector3d& point) const {
    constexpr double near = 16;  // In units.
    return !((point - origin).array().abs() <= near * unit).all();
  }

  /// Moves the start of a ray that is far away to the box. @return false if it does not meet it.
  bool begin(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double max_distance,
             double& min_distance) const {
    if (!is_far(from + min_distance * direction)) return true;
    const auto way = passage(box, from, direction);
    if (way) min_distance = std::max(min_distance, way->first);
    return way && way->first <= max_distance;
  }

  RTCRayHit ray(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double min_distance,
                double max_distance) const {
    // Embree finds no hits behind a ray's origin, so the ray starts at `min_distance`.
    const Eigen::Vector3d start = from + min_distance * direction;
    return embree::search_along(embree::ray_of({local(start.x(), 0), local(start.y(), 1), local(start.z(), 2)},
                                               direction, (max_distance - min_distance) / unit));
  }
};

TriangleScene::TriangleScene(const std::vector<const TriangleMesh*>& meshes, const Eigen::Vector3d& origin, double unit)
    : state_(new State{origin, unit, {}, nullptr, nullptr}) {
  const auto has_triangles = [](const TriangleMesh* mesh) { return !mesh->triangles.empty(); };
  if (std::none_of(meshes.begin(), meshes.end(), has_triangles)) return;
  state_->enclose(meshes);
  state_->start(RTC_BUILD_QUALITY_HIGH);
  for (std::size_t i = 0; i < meshes.size(); ++i)
    if (has_triangles(meshes[i])) state_->attach(static_cast<unsigned>(i), meshes[i]->vertices, meshes[i]->triangles);
  state_->commit();
}

TriangleScene::TriangleScene(const std::vector<Eigen::Vector2d>& vertices,
                             const std::vector<std::array<std::uint32_t, 3>>& triangles, const Eigen::Vector2d& origin,
                             double unit)
    : state_(new State{{origin.x(), origin.y(), 0}, unit, {}, nullptr, nullptr}) {
  if (triangles.empty()) return;
  state_->start(RTC_BUILD_QUALITY_MEDIUM);
  state_->attach(0, vertices, triangles);
  state_->commit();
}

std::optional<TriangleHit> TriangleScene::nearest(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                                  double min_distance, double max_distance) const {
  if (!state_->scene) return std::nullopt;
  if (!state_->begin(from, direction, max_distance, min_distance)) return std::nullopt;
  RTCRayHit ray = state_->ray(from, direction, min_distance, max_distance);
  embree::intersect(state_->scene.get(), ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return TriangleHit{min_distance + ray.ray.tfar * state_->unit, ray.hit.geomID, ray.hit.primID,
                     is_clear(ray.hit.u, ray.hit.v)};
}

std::uint32_t TriangleScene::met(const Segment* segments, int count, double margin, bool outwards) const {
  if (!state_->scene) return 0;
  alignas(64) RTCRay16 rays{};
  std::uint32_t valid = 0;
  Eigen::AlignedBox3f starts;
  float longest = 0;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d way = segments[i].to - segments[i].from;
    const double length = way.norm();
    const RTCRay ray = state_->ray(segments[i].from, way / length, -margin, length + margin).ray;
    if (!embree::is_valid(ray)) continue;
    valid |= 1u << i;
    rays.org_x[i] = ray.org_x;
    rays.org_y[i] = ray.org_y;
    rays.org_z[i] = ray.org_z;
    rays.dir_x[i] = ray.dir_x;
    rays.dir_y[i] = ray.dir_y;
    rays.dir_z[i] = ray.dir_z;
    rays.tfar[i] = ray.tfar;
    rays.mask[i] = ray.mask;
    starts.extend(Eigen::Vector3f(ray.org_x, ray.org_y, ray.org_z));
    longest = std::max(longest, ray.tfar);
  }
  return (((1u << count) - 1) & ~valid) |
         embree::occluded(state_->scene.get(), rays, valid, outwards ? take_outwards : nullptr,
                          starts.diagonal().norm() < 8 * longest);
}

void TriangleScene::crossings(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double min_distance,
                              double max_distance, std::vector<TriangleCrossing>& crossings) const {
  crossings.clear();
  if (!state_->scene) return;
  if (!state_->begin(from, direction, max_distance, min_distance)) return;
  const auto add = [](void* user, const embree::MetTriangle& met) {
    static_cast<std::vector<TriangleCrossing>*>(user)->push_back(
        {met.distance, met.geometry, met.primitive, met.along > 0 ? 1 : -1, is_clear(met.u, met.v)});
  };
  embree::visit_all(state_->scene.get(), state_->ray(from, direction, min_distance, max_distance), add, &crossings);
  if (crossings.size() > 1) sort_and_join(crossings);
  for (TriangleCrossing& crossing : crossings) crossing.distance = min_distance + crossing.distance * state_->unit;
}

void TriangleScene::along(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                          std::vector<TriangleId>& candidates) const {
  candidates.clear();
  if (!state_->scene) return;
  double start = -1e-5 * state_->unit;  // Triangles at the start must not be lost.
  if (state_->is_far(from)) {
    const auto way = passage(state_->box, from, direction);
    if (!way) return;
    start = std::max(start, way->first);
  }
  const auto add = [](void* user, const embree::MetTriangle& met) {
    static_cast<std::vector<TriangleId>*>(user)->push_back({met.geometry, met.primitive});
  };
  embree::visit_all(state_->scene.get(), state_->ray(from, direction, start, std::numeric_limits<double>::infinity()),
                    add, &candidates);
  sort_and_join(candidates);
}

void TriangleScene::near(const Eigen::Vector3d& point, double radius, std::vector<TriangleId>& candidates) const {
  candidates.clear();
  if (!state_->scene) return;
  RTCPointQuery query{};
  query.x = state_->local(point.x(), 0);
  query.y = state_->local(point.y(), 1);
  query.z = state_->local(point.z(), 2);
  if (!embree::fits(query.x) || !embree::fits(query.y) || !embree::fits(query.z)) return;
  query.radius = static_cast<float>(radius / state_->unit);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(state_->scene.get(), &query, &context, add_candidate, &candidates);
  sort_and_join(candidates);
}

}  // namespace tensorray
