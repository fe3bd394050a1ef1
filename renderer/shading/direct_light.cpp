#include <algorithm>
#include <cmath>
#include <optional>

#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// Whether something blocks the light of a sample of `point`. The ray starts a little off `point`, so it must be aimed
/// again at the position on the light: otherwise it would meet the light too early at a grazing angle.
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

Eigen::Map<const Eigen::ArrayXf> as_array(const std::vector<float>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// At the edge of a map of light, which its pixels make smooth, straight light ends as smoothly: takes the light of
/// the map from the sample, and leaves in `of_one_light` the part of it that comes straight.
/// @param enters  Whether the sample's ray enters the region. @return the light's index; −1: the point is at no edge.
int split_at_edge(Wavefront& front, const PathState& path, bool enters) {
  constexpr double rounding = 1e-5;
  const SurfaceHit& hit = path.vertex.hit;
  LightSample& light = front.memory.light_sample;
  std::vector<float>& part = front.memory.of_one_light;
  for (const IrradianceMap& map : front.scene.irradiance_maps) {
    const bool may_be_it = light.light == map.light || (light.light < 0 && !light.is_delta);
    if (!may_be_it || map.surface != hit.surface) continue;
    const std::optional<double> through = straight_at(map, hit.position);
    if (!through || std::abs(*through - (enters ? 1 : 0)) < rounding) continue;
    if (!is_lit(map, hit.position, path.vertex.direction)) continue;
    if (light.light == map.light)
      part = light.radiance;
    else
      front.scene.lights.background(light.direction, part, true, map.light, path.bands());
    if (!(as_array(part).maxCoeff() > 0)) continue;
    for (std::size_t band = 0; band < part.size(); ++band) {
      light.radiance[band] = std::max(0.0f, light.radiance[band] - part[band]);
      part[band] *= static_cast<float>(1 - *through);
    }
    return map.light;
  }
  return -1;
}

/// The background's light is divided as the radiances of its lights.
void add_to_groups(Wavefront& front, const PathState& path, const BandValues& light, const LightSource& source) {
  const ShadedScene& scene = front.scene;
  const Eigen::Index first = front.column(path.ray + 1) - scene.groups;
  const auto group_of = [&](int each) { return scene.group_of_light[static_cast<std::size_t>(each)]; };
  const auto layer_of = [&](int each) {
    return front.light.col(first + group_of(each)).segment(path.first_band(), light.size());
  };
  if (source.light >= 0) {
    if (group_of(source.light) >= 0) layer_of(source.light) += light;
    return;
  }
  std::vector<float>& radiance = front.memory.of_one_light;
  for (int each = 0; each < static_cast<int>(scene.group_of_light.size()); ++each) {
    if (group_of(each) < 0) continue;
    scene.lights.background(source.direction, radiance, source.disks, each, path.bands());
    auto layer = layer_of(each);
    for (std::size_t band = 0; band < radiance.size(); ++band)
      if (const auto i = static_cast<Eigen::Index>(band); radiance[band] > 0 && (*source.radiance)[band] > 0)
        layer[i] += light[i] * radiance[band] / (*source.radiance)[band];
  }
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
  const bool enters = enters_region(scene, ray, light.distance);
  const int split = split_at_edge(front, path, enters);
  if ((!enters || split >= 0) && !is_shadowed(scene.surfaces, light, ray.origin, vertex.point)) {
    double factor = std::abs(wi.z()) / light.pdf;
    if (front.settings.direct == DirectLight::both && !light.is_delta) {
      const double ratio = material_pdf / light.pdf;
      factor /= 1 + ratio * ratio;
    }
    const auto add = [&](const std::vector<float>& radiance, BandValues& scattered, const LightSource& source) {
      scattered *= path.throughput * as_array(radiance).cast<double>() * factor;
      add_light(front, path, scattered, source);
    };
    BandValues of_map;
    if (split >= 0) add(front.memory.of_one_light, of_map = contribution, {split});
    if (!enters) return add(light.radiance, contribution, {light.light, light.direction, split < 0, &light.radiance});
  }
  if (enters) seek_bent_light(front, path, ray, wi, contribution);
}

void add_light(Wavefront& front, const PathState& path, BandValues& light, const LightSource& source) {
  const double brightness_of_light = brightness(front.scene, path, light), most = front.settings.indirect_clamp;
  if (!std::isfinite(brightness_of_light)) return;
  if (path.depth >= 2 && most > 0 && brightness_of_light > most) light *= most / brightness_of_light;
  front.light.col(front.column(path.ray)).segment(path.first_band(), light.size()) += light;
  if (front.scene.groups > 0) add_to_groups(front, path, light, source);
}

void add_background(Wavefront& front, const PathState& path, const Vector3d& direction, double weight, bool disks) {
  if (!(weight > 0)) return;
  std::vector<float>& radiance = front.memory.background;
  front.scene.lights.background(direction, radiance, disks, -1, path.bands());
  BandValues& light = front.memory.contribution;
  light = path.throughput * as_array(radiance).cast<double>() * weight;
  add_light(front, path, light, {-1, direction, disks, &radiance});
}

void add_emission(Wavefront& front, const PathState& path, const SurfaceHit& hit, const Vector3d& direction,
                  double weight) {
  const int light = front.scene.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(weight > 0)) return;
  const std::vector<float>* emitted = front.scene.lights.emitted(light, hit.normal, direction);
  if (emitted == nullptr) return;
  BandValues& found = front.memory.contribution;
  found =
      path.throughput * as_array(*emitted).segment(path.first_band(), path.throughput.size()).cast<double>() * weight;
  add_light(front, path, found, {light});
}

}  // namespace tensorray
