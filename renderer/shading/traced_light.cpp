#include <cmath>

#include "base/constants.h"
#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t first_photon_dimension = 1u << 21;  ///< For maps of photons; one for each depth.

/// Adds light to the ray's radiance, and to its layer of light that was traced beforehand.
void add_to_layer(Wavefront& front, const PathState& path, BandValues& light, int source) {
  add_light(front, path, light, {source});
  if (light.allFinite()) front.light.col(front.column(path.ray) + 1).segment(path.first_band(), light.size()) += light;
}

void add_irradiance_maps(Wavefront& front, const PathState& path) {
  const Vertex& vertex = path.vertex;
  BandValues &scattered = front.memory.contribution, &irradiance = front.memory.weight;
  for (const IrradianceMap& map : front.scene.irradiance_maps) {
    if (map.surface != vertex.hit.surface || !is_lit(map, vertex.hit.position, vertex.direction)) continue;
    const Vector3d wi = vertex.to_local(direction_towards(map, vertex.hit.position));
    scattered.resize(path.throughput.size());
    evaluate(*vertex.material, vertex.view, vertex.reflectance, wi, scattered);
    if (map.body) scattered *= std::abs(wi.z());
    irradiance.setZero(path.throughput.size());
    add_irradiance(map, vertex.hit.position, irradiance, path.first_band());
    scattered *= path.throughput * irradiance;
    if (scattered.maxCoeff() > 0) add_to_layer(front, path, scattered, map.light);
  }
}

/// The map from which a surface takes its photons: by chance, so that photons' noise is that of samples.
const PhotonMap& photon_map(const ShadedScene& scene, const PathState& path) {
  PathSampler choice = path.sampler;
  choice.dimension = first_photon_dimension + static_cast<std::uint32_t>(path.depth);
  const std::vector<PhotonMap>& maps = scene.photons->passes;
  return maps[static_cast<std::size_t>(choice.next_1d() * static_cast<double>(maps.size()))];
}

/// The weight of a photon of an area light beside the techniques that look for the light from the surface.
double photon_mis_weight(const Wavefront& front, const Vertex& vertex, const Photon& photon, double radius) {
  const Vector3d direction = -photon.direction.cast<double>();
  const double own = photon.density * pi * radius * radius * std::abs(direction.dot(vertex.hit.normal));
  if (!(own > 0)) return 0;
  // Where the photon is: seen from the vertex beside it, aim in its direction might miss the light.
  const double aimed = front.scene.lights.direction_pdf(photon.position.cast<double>(), direction);
  const DirectLight direct = front.settings.direct;
  const double scattered = direct == DirectLight::lights && aimed > 0
                               ? 0
                               : pdf(*vertex.material, vertex.view, vertex.reflectance, vertex.to_local(direction));
  const double by_light = (direct == DirectLight::material ? 0 : aimed) / own, by_material = scattered / own;
  return 1 / (1 + by_light * by_light + by_material * by_material);
}

/// Sets the sums of the light of photons at the last surface of the path: for each group and for lights without one,
/// that of area lights after that of others. Those of a diffuse surface are without its reflectance.
void sum_photons(Wavefront& front, const PathState& path, bool diffuse) {
  const Vertex& vertex = path.vertex;
  const PhotonMap& map = photon_map(front.scene, path);
  std::vector<PhotonSum>& sums = front.memory.photon_sums;
  sums.resize(static_cast<std::size_t>(2 * (front.scene.groups + 1)));
  for (PhotonSum& sum : sums) sum.light = -1;
  BandValues& scattering = front.memory.contribution;
  scattering.resize(path.throughput.size());
  map.visit(vertex.hit, path.band, [&](const Photon& photon, double density) {
    const Vector3d wi = vertex.to_local(-photon.direction.cast<double>());
    double scattered = density * photon.power;
    if (!diffuse) {
      evaluate(*vertex.material, vertex.view, vertex.reflectance, wi, scattering);
      scattered *= scattering[photon.band - path.first_band()];
    } else if (!(wi.z() * vertex.view.wo.z() > 0)) {
      return;
    }
    const bool is_of_area = photon.density > 0;
    if (is_of_area) scattered *= photon_mis_weight(front, vertex, photon, map.radius());
    const int group = front.scene.groups > 0 ? front.scene.group_of_light[static_cast<std::size_t>(photon.light)] : -1;
    PhotonSum& sum = sums[static_cast<std::size_t>(2 * (group + 1) + (is_of_area ? 1 : 0))];
    if (sum.light < 0) sum.scattered.setZero(path.throughput.size());
    sum.light = photon.light;
    sum.scattered[photon.band - path.first_band()] += scattered;
  });
}

void add_photons(Wavefront& front, const PathState& path) {
  const bool diffuse = is_diffuse(*path.vertex.material);
  sum_photons(front, path, diffuse);
  BandValues& light = front.memory.contribution;
  for (std::size_t i = 0; i < front.memory.photon_sums.size(); ++i) {
    const PhotonSum& sum = front.memory.photon_sums[i];
    if (sum.light < 0) continue;
    light = path.throughput * sum.scattered;
    if (diffuse) light *= path.vertex.reflectance / pi;
    const bool is_of_area = i % 2 == 1;
    if (is_of_area)
      add_light(front, path, light, {sum.light});
    else
      add_to_layer(front, path, light, sum.light);
  }
}

}  // namespace

void add_traced_light(Wavefront& front, PathState& path) {
  if (!front.scene.irradiance_maps.empty()) add_irradiance_maps(front, path);
  if (front.scene.has_photons()) add_photons(front, path);
}

PhotonMis photon_mis(const ShadedScene& scene, const PathState& path, const Vector3d& direction, double pdf) {
  PhotonMis result;
  if (!scene.has_photons()) return result;
  const double radius = photon_map(scene, path).radius();
  result.pdf = pdf;
  result.disk = pi * radius * radius * std::abs(direction.dot(path.vertex.hit.normal));
  result.surface = path.vertex.hit.surface;
  return result;
}

double mis_weight_beside_photons(const ShadedScene& scene, const WaitingPath& path, const BentRay& ray,
                                 const SurfaceHit& hit) {
  const PhotonMis& photons = path.photons;
  const int light = scene.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(photons.disk > 0)) return 1;
  const auto& area = scene.photons->areas[static_cast<std::size_t>(light)];
  if (!area || !area->surfaces[photons.surface]) return 1;
  const double density = area->count * area->emitter.density(hit.position, hit.normal, -ray.direction);
  const double ratio = density * ray.jacobian * photons.disk / photons.pdf;
  return 1 / (1 + path.mis_weight * ratio * ratio);
}

}  // namespace tensorray
