#include <cmath>

#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// Whether something blocks the light of a sample of `point`. The ray starts a little off `point`, so it must be aimed
/// again at the position on the light: otherwise it would meet the light itself too early where it is seen at a grazing
/// angle.
bool is_shadowed(const SurfaceScene& surfaces, const LightSample& light, const Vector3d& start, const Vector3d& point) {
  if (std::isinf(light.distance)) return surfaces.occluded(start, light.direction);
  const Vector3d way = point + light.distance * light.direction - start;
  const double distance = way.norm();
  return distance > 0 && surfaces.occluded(start, way / distance, distance);
}

/// Looks for the light of a sample through the region: follows its direction, and will add the light that it meets,
/// whatever that is. The density is that of the direction at the surface, so that bending does not change it.
/// @param scattered  f of the material; changed.
void seek_bent_light(Wavefront& front, const PathState& path, const StraightRay& ray, const Vector3d& wi,
                     BandValues& scattered) {
  const ShadedScene& scene = front.scene;
  const Vertex& vertex = path.vertex;
  if (!front.aims_bent || front.memory.light_sample.is_delta) return;
  const double density = scene.lights.direction_pdf(vertex.point, ray.direction);
  if (!(density > 0)) return;
  if (scene.surfaces.occluded(ray.origin, ray.direction, scene.region->entry(ray.origin, ray.direction))) return;
  double factor = std::abs(wi.z()) / density, others = 1;
  if (front.settings.direct == DirectLight::both) {
    const double ratio = pdf(*vertex.material, vertex.view, vertex.reflectance, wi) / density;
    others = 1 + ratio * ratio;
    factor /= others;
  }
  scattered = factor * scattered * path.throughput;
  WaitingPath seeking;
  seeking.seeks_light = true;
  seeking.mis_weight = 1 / others;
  seeking.photons = photon_mis(scene, path, ray.direction, density);
  wait_at_region(front, path, ray, scattered, seeking);
}

}  // namespace

void sample_direct_light(Wavefront& front, PathState& path, const Eigen::Vector2d& u) {
  const ShadedScene& scene = front.scene;
  const Vertex& vertex = path.vertex;
  LightSample& light = front.memory.light_sample;
  if (!scene.lights.sample(vertex.point, u, light, path.bands())) return;
  if (front.settings.direct == DirectLight::material && !light.is_delta) return;
  const Vector3d wi = vertex.to_local(light.direction);
  BandValues& contribution = front.memory.contribution;
  contribution.resize(path.throughput.size());
  const double material_pdf = evaluate(*vertex.material, vertex.view, vertex.reflectance, wi, contribution);
  if (!(contribution.maxCoeff() > 0)) return;
  const StraightRay ray{vertex.start(scene.surfaces, wi), light.direction};
  if (enters_region(scene, ray, light.distance)) return seek_bent_light(front, path, ray, wi, contribution);
  if (is_shadowed(scene.surfaces, light, ray.origin, vertex.point)) return;
  double factor = std::abs(wi.z()) / light.pdf;
  if (front.settings.direct == DirectLight::both && !light.is_delta) {
    const double ratio = material_pdf / light.pdf;
    factor /= 1 + ratio * ratio;
  }
  const Eigen::Map<const Eigen::ArrayXf> radiance(light.radiance.data(),
                                                  static_cast<Eigen::Index>(light.radiance.size()));
  contribution *= path.throughput * radiance.cast<double>() * factor;
  add_light(front, path, contribution, {light.light, light.direction, true, &light.radiance});
}

}  // namespace tensorray
