#include <cmath>
#include <utility>

#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

constexpr std::uint32_t first_bent_dimension = 1u << 20;  ///< For wavelengths within their bands; one for each depth.
constexpr double part_of_pixel = 0.2;                     ///< That the bent light of the camera may miss.

/// The number of bands for which one that is followed into the region stands.
double bands_per_bent_ray(const ShadedScene& scene, const PathState& path) {
  if (path.band >= 0) return 1;
  return static_cast<double>(scene.colors.bands()) / (path.depth == 0 ? scene.bands_per_view : scene.bands_per_bounce);
}

/// Makes `path` the part of a waiting path that one of its bent rays carries, before it meets what is at its end.
void follow_bent_ray(const Wavefront& front, const WaitingPath& waiting, std::size_t ray, PathState& path) {
  const BentRay& bent = front.traced.rays[ray];
  path.ray = waiting.ray;
  path.sampler = front.samplers[waiting.ray];
  path.depth = waiting.depth;
  path.band = bent.band;
  path.stands_for = waiting.stands_for;
  path.throughput.setConstant(1, front.traced.throughput[ray] * (bent.radiance_scale * waiting.share));
}

BentView bent_view(const BentPaths& traced, const WaitingPath& waiting) {
  BentView view{0, 0, 0};
  const auto count = static_cast<double>(waiting.last - waiting.first);
  int arrived = 0;
  for (std::size_t i = waiting.first; i < waiting.last; ++i) {
    const BentRay& ray = traced.rays[i];
    if (!ray.arrives) continue;
    const Eigen::Vector3d& before = waiting.direction;
    view.radiance_scale += ray.radiance_scale / count;
    view.deflection += std::atan2(ray.direction.cross(before).norm(), ray.direction.dot(before)) / count;
    ++arrived;
  }
  view.arrives = arrived / count;
  return view;
}

void continue_bent_ray(Wavefront& front, const WaitingPath& waiting, std::size_t number, PathState& path) {
  const BentRay& ray = front.traced.rays[number];
  const bool is_view = waiting.depth == 0;
  follow_bent_ray(front, waiting, number, path);
  const auto hit = surface_at_end(front.scene.surfaces, ray);
  if (!hit) {
    if (!is_view || front.show_background) add_background(front, path, ray.direction, waiting.mis_weight, is_view);
    return;
  }
  if (front.settings.shading == Shading::path)
    add_emission(front, path, *hit, ray.direction,
                 waiting.mis_weight * mis_weight_beside_photons(front.scene, waiting, ray, *hit));
  if (!is_view && path.depth == front.settings.max_depth) return;
  meet_surface(front.scene, *hit, ray.direction, path);
  const bool is_to_middle = number - waiting.first <= (waiting.last - waiting.first) / 2;
  if (is_view && is_to_middle) front.views[path.ray].surface = FirstSurface{*hit, path.vertex.normal, ray.direction};
  shade_surface(front, path);
}

/// Continues a path that has left the region as a path for each bent ray.
void continue_path(Wavefront& front, const WaitingPath& waiting, PathState& path) {
  RayView& view = front.views[waiting.ray];
  if (waiting.depth == 0) view.bent = bent_view(front.traced, waiting);
  for (std::size_t i = waiting.first; i < waiting.last; ++i)
    if (front.traced.rays[i].arrives) continue_bent_ray(front, waiting, i, path);
  if (waiting.depth > 0 || !view.surface) return;
  BandValues& reflectance = front.memory.albedo;
  reflectance.resize(front.scene.colors.bands());
  set_reflectance(front.scene, view.surface->hit, 0, reflectance);
  view.surface->albedo = albedo(front.scene, view.surface->hit, reflectance);
}

/// Adds the light that a path has met which seeks it.
void bring_light(Wavefront& front, const WaitingPath& waiting, PathState& path) {
  for (std::size_t i = waiting.first; i < waiting.last; ++i) {
    const BentRay& ray = front.traced.rays[i];
    if (!ray.arrives) continue;
    const auto hit = surface_at_end(front.scene.surfaces, ray);
    if (hit && front.scene.surfaces.surfaces()[hit->surface].light < 0) continue;
    follow_bent_ray(front, waiting, i, path);
    if (hit)
      add_emission(front, path, *hit, ray.direction, mis_weight_beside_photons(front.scene, waiting, ray, *hit));
    else
      add_background(front, path, ray.direction, 1, false);
  }
}

}  // namespace

bool enters_region(const ShadedScene& scene, const StraightRay& ray, double distance) {
  return scene.region && scene.region->entry(ray.origin, ray.direction) < distance;
}

void wait_at_region(Wavefront& front, const PathState& path, const StraightRay& ray, const BandValues& throughput,
                    WaitingPath waiting) {
  PathSampler places = path.sampler;
  places.dimension = first_bent_dimension + static_cast<std::uint32_t>(path.depth);
  BentRay bent;
  bent.place = places.next_1d();
  if (path.depth == 0) bent.tolerance = part_of_pixel * front.settings.pixel_angle;
  bent.position = ray.origin;
  bent.direction = ray.direction;
  waiting.ray = path.ray;
  waiting.depth = path.depth;
  waiting.share = bands_per_bent_ray(front.scene, path);
  waiting.stands_for = path.stands_for * waiting.share;
  waiting.direction = ray.direction;
  waiting.first = front.waiting.rays.size();
  const int bands = static_cast<int>(front.scene.colors.bands()), parts = static_cast<int>(waiting.share);
  const int first = static_cast<int>((places.pixel + places.sample) % static_cast<std::uint64_t>(parts));
  for (int band = path.band < 0 ? first : path.band; band < bands; band += path.band < 0 ? parts : bands) {
    if (!(path.throughput[band - path.first_band()] > 0)) continue;
    bent.band = band;
    front.waiting.rays.push_back(bent);
    front.waiting.throughput.push_back(throughput[band - path.first_band()]);
  }
  waiting.last = front.waiting.rays.size();
  front.waiting.paths.push_back(waiting);
}

void trace_bent_rays(Wavefront& front) {
  std::swap(front.waiting, front.traced);
  front.waiting.clear();
  front.scene.region->trace_radiance(front.traced.rays);
}

void continue_paths(Wavefront& front, PathState& path) {
  for (const WaitingPath& waiting : front.traced.paths)
    if (waiting.seeks_light)
      bring_light(front, waiting, path);
    else
      continue_path(front, waiting, path);
}

}  // namespace tensorray
