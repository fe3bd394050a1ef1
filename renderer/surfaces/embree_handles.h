#pragma once
/// The only file that includes Embree; private to the scenes that use it. Embree 3 and 4 have the same owning handles.

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "base/text/content_hash.h"

namespace tensorray::embree {

/// Whether Embree can compute with a coordinate: its square fits in single precision. False for NaN.
inline bool fits(float x) { return std::abs(x) <= 1e18f; }

/// Whether Embree can trace the ray. Embree ends the process on a ray that has a NaN or a value that is too large.
inline bool is_valid(const RTCRay& ray) {
  return fits(ray.org_x) && fits(ray.org_y) && fits(ray.org_z) && fits(ray.dir_x) && fits(ray.dir_y) &&
         fits(ray.dir_z) && !std::isnan(ray.tfar);
}

inline RTCRay ray_of(const Eigen::Vector3f& origin, const Eigen::Vector3d& direction, double length) {
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tfar = static_cast<float>(length);
  ray.mask = 0xffffffffu;
  return ray;
}

/// A ray of a search that has found nothing yet.
inline RTCRayHit search_along(const RTCRay& ray) {
  RTCRayHit result{};
  result.ray = ray;
  result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return result;
}

#if RTC_VERSION_MAJOR >= 4
using QueryContext = RTCRayQueryContext;
constexpr RTCSceneFlags all_triangles_flag = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

/// Embree's search for the nearest hit. @param context  To be initialized. @param filter  May refuse hits; or null.
inline void search(RTCScene scene, RTCRayHit& ray, QueryContext& context, RTCFilterFunctionN filter) {
  rtcInitRayQueryContext(&context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  if (filter)
    arguments.flags = static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  arguments.context = &context;
  arguments.filter = filter;
  rtcIntersect1(scene, &ray, &arguments);
}
#else
using QueryContext = RTCIntersectContext;
constexpr RTCSceneFlags all_triangles_flag = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

inline void search(RTCScene scene, RTCRayHit& ray, QueryContext& context, RTCFilterFunctionN filter) {
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcIntersect1(scene, &context, &ray);
}
#endif

/// Does not change a ray that is not valid: it meets nothing.
inline void intersect(RTCScene scene, RTCRayHit& ray) {
  QueryContext context;
  if (is_valid(ray.ray)) search(scene, ray, context, nullptr);
}

/// The same for rays that go nearly alike, in one call where Embree has one.
inline void intersect(RTCScene scene, std::vector<RTCRayHit>& rays) {
#if RTC_VERSION_MAJOR >= 4
  for (RTCRayHit& ray : rays) intersect(scene, ray);
#else
  for (RTCRayHit& ray : rays)
    if (!is_valid(ray.ray)) ray.ray = ray_of({0, 0, 0}, {1, 0, 0}, -1);  // It meets nothing.
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1M(scene, &context, rays.data(), static_cast<unsigned>(rays.size()), sizeof(RTCRayHit));
#endif
}

/// Where a ray meets a triangle; see Embree's ray and hit.
struct MetTriangle {
  unsigned geometry, primitive;
  float distance, u, v;
  float along;  // The ray's direction times the triangle's normal, of any length.
};

/// Calls `add` for each triangle along a ray, some of them more than once. The scene needs `all_triangles_flag`.
inline void visit_all(RTCScene scene, RTCRayHit ray, void (*add)(void*, const MetTriangle&), void* user) {
  struct AllTriangles {
    QueryContext context;  // First, so that its address is that of the whole.
    void (*add)(void* user, const MetTriangle& triangle);
    void* user;

    /// Refuses all hits, so that the search goes on.
    static void take(const RTCFilterFunctionNArguments* arguments) {
      auto* const all = reinterpret_cast<AllTriangles*>(arguments->context);
      const RTCRay ray = rtcGetRayFromRayN(arguments->ray, arguments->N, 0);
      const RTCHit hit = rtcGetHitFromHitN(arguments->hit, arguments->N, 0);
      const Eigen::Vector3f normal(hit.Ng_x, hit.Ng_y, hit.Ng_z);
      const float along = normal.dot(Eigen::Vector3f(ray.dir_x, ray.dir_y, ray.dir_z));
      all->add(all->user, {hit.geomID, hit.primID, ray.tfar, hit.u, hit.v, along});
      arguments->valid[0] = 0;
    }
  } all{{}, add, user};
  if (is_valid(ray.ray)) search(scene, ray, all.context, AllTriangles::take);
}

/// Sets tfar to −infinity if the ray meets anything. A ray that is not valid meets nothing.
inline void occluded(RTCScene scene, RTCRay& ray) {
  if (!is_valid(ray)) return;
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

/// Bits of those of some rays that meet anything. All must be valid. @param is_coherent  Whether they go nearly alike.
inline std::uint32_t occluded(RTCScene scene, RTCRay16& rays, std::uint32_t which, RTCFilterFunctionN filter,
                              bool is_coherent) {
  alignas(64) int valid[16];
  for (int i = 0; i < 16; ++i) valid[i] = which >> i & 1 ? -1 : 0;
  QueryContext context;
#if RTC_VERSION_MAJOR >= 4
  rtcInitRayQueryContext(&context);
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  const auto order = is_coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  arguments.flags = static_cast<RTCRayQueryFlags>(RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER | order);
  arguments.context = &context;
  arguments.filter = filter;
  rtcOccluded16(valid, scene, &rays, &arguments);
#else
  rtcInitIntersectContext(&context);
  context.filter = filter;
  if (is_coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &context, &rays);
#endif
  std::uint32_t met = 0;
  for (int i = 0; i < 16; ++i) met |= valid[i] && rays.tfar[i] < 0 ? 1u << i : 0;
  return met;
}

/// Lets rays through a geometry, but for the part `opacity` of them. Which rays meet it is a function of the ray and
/// the triangle alone. @param opacity  Must outlive the geometry.
inline void let_through(RTCGeometry geometry, const float& opacity) {
  const auto filter = [](const RTCFilterFunctionNArguments* all) {
    for (unsigned i = 0; i < all->N; ++i) {
      const float ray[] = {RTCRayN_org_x(all->ray, all->N, i), RTCRayN_org_y(all->ray, all->N, i),
                           RTCRayN_org_z(all->ray, all->N, i), RTCRayN_dir_x(all->ray, all->N, i),
                           RTCRayN_dir_y(all->ray, all->N, i), RTCRayN_dir_z(all->ray, all->N, i)};
      const std::uint64_t hash =
          content_hash({reinterpret_cast<const char*>(ray), sizeof ray}, RTCHitN_primID(all->hit, all->N, i));
      const float part = static_cast<float>(hash >> 40) * 0x1p-24f;
      if (part >= *static_cast<const float*>(all->geometryUserPtr)) all->valid[i] = 0;
    }
  };
  rtcSetGeometryUserData(geometry, const_cast<float*>(&opacity));
  rtcSetGeometryIntersectFilterFunction(geometry, filter);
  rtcSetGeometryOccludedFilterFunction(geometry, filter);
}

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};

template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

/// @throw std::runtime_error if an Embree call has failed since the last check.
inline void check(RTCDevice device) {
  if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot build the scene (error " + std::to_string(error) + ")");
}

/// @throw std::bad_alloc; std::runtime_error with the cause.
/// A device costs a tenth of a millisecond, so every scene has its own and scenes share no state.
/// @param settings  Embree's, as text; null: none.
inline Owned<RTCDevice> make_device(const char* settings = nullptr) {
  Owned<RTCDevice> device(rtcNewDevice(settings));
  if (device) return device;
  const RTCError error = rtcGetDeviceError(nullptr);
  if (error == RTC_ERROR_UNSUPPORTED_CPU)
    throw std::runtime_error("Embree cannot start on this processor: it needs SSE2 or NEON");
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw std::runtime_error(
      "Embree cannot start (error " + std::to_string(error) +
      "): the limits of this process on memory or threads may be too low (`ulimit -v`, `ulimit -u`)");
}

}  // namespace tensorray::embree
