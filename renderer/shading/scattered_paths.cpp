#include <algorithm>
#include <limits>

#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// First dimension of the sampler for shading; the camera uses those before.
constexpr std::uint32_t first_dimension = 2;
constexpr std::uint32_t dimensions_per_vertex = 4;

/// The part of its light's luminance that a path must carry to go on in any case. Measured on tubes in a studio's light
/// (docs/dev/performance_notes.md): with 1/2 and 1/4 there is more noise for the time; with 1/16 it is the same.
constexpr double min_carried = 0.1;

/// Chooses the direction in which the path leaves its surface, and changes its throughput.
/// @param u           In [0, 1)².
/// @param refraction  The product of ScatteringSample::refraction along the path; changed.
/// @return nothing if the path ends.
std::optional<ScatteringSample> scatter(Wavefront& front, PathState& path, const Eigen::Vector2d& u,
                                        double& refraction) {
  const Vertex& vertex = path.vertex;
  const double side = is_glass(*vertex.material) ? path.sampler.next_1d() : 0;
  BandValues& weight = front.memory.weight;
  weight.resize(path.throughput.size());
  const auto scattered = sample(*vertex.material, vertex.view, vertex.reflectance, {u.x(), u.y(), side}, weight);
  if (!scattered) return std::nullopt;
  path.throughput *= weight;
  refraction *= scattered->refraction;
  if (path.depth < front.settings.roulette_depth) return scattered;
  // Light that would hardly be seen is followed rarely: the brightness of what the path still carries decides.
  const double survival = std::min(1.0, brightness(front.scene, path, path.throughput) / (min_carried * refraction));
  if (survival < 1) {
    if (!(path.sampler.next_1d() < survival)) return std::nullopt;
    path.throughput /= survival;
  }
  return scattered;
}

/// Follows a ray that has left the surface of the path to what it meets, and adds the light that it finds there.
/// @param pdf  Of its direction.
/// @return the surface that it has met, unless the path ends.
std::optional<SurfaceHit> find_surface(Wavefront& front, PathState& path, const StraightRay& ray, double pdf) {
  const ShadedScene& scene = front.scene;
  const ShadingSettings& settings = front.settings;
  const Vector3d &point = path.vertex.point, &direction = ray.direction;
  const auto hit = scene.surfaces.intersect(ray.origin, direction);
  if (enters_region(scene, ray, hit ? hit->distance : std::numeric_limits<double>::infinity())) {
    const auto light_pdf = [&] { return scene.lights.direction_pdf(point, direction); };
    WaitingPath waiting;
    waiting.mis_weight = front.aims_bent ? material_mis_weight(settings, pdf, light_pdf) : 1;
    waiting.photons = photon_mis(scene, path, direction, pdf);
    wait_at_region(front, path, ray, path.throughput, waiting);
    return std::nullopt;
  }
  if (!hit) {
    const auto light_pdf = [&] { return scene.lights.background_pdf(direction); };
    add_background(front, path, direction, material_mis_weight(settings, pdf, light_pdf));
    return std::nullopt;
  }
  if (const int light = scene.surfaces.surfaces()[hit->surface].light; light >= 0) {
    const auto light_pdf = [&] { return scene.lights.area_pdf(light, point, hit->position, hit->normal); };
    add_emission(front, path, *hit, direction, material_mis_weight(settings, pdf, light_pdf));
  }
  return hit;
}

/// Directions below the geometric surface but above the shaded one are followed like all others, from the lifted point.
/// They find the light that the surface itself does not block.
void follow_path(Wavefront& front, PathState& path) {
  double refraction = 1;
  while (path.depth <= front.settings.max_depth) {
    path.sampler.dimension = first_dimension + dimensions_per_vertex * static_cast<std::uint32_t>(path.depth - 1);
    add_traced_light(front, path);
    const SurfaceNumbers numbers = path.sampler.at_surface(path.depth);
    sample_direct_light(front, path, numbers.light);
    const auto scattered = scatter(front, path, numbers.direction, refraction);
    if (!scattered) return;
    const StraightRay ray{path.vertex.start(front.scene.surfaces, scattered->wi), path.vertex.frame * scattered->wi};
    const auto hit = find_surface(front, path, ray, scattered->pdf);
    if (!hit || path.depth == front.settings.max_depth) return;
    meet_surface(front.scene, *hit, ray.direction, path);
  }
}

/// The radiance of the camera's ray, in the bands of the path.
auto ray_light(Wavefront& front, const PathState& path) {
  return front.light.col(front.column(path.ray)).segment(path.first_band(), path.throughput.size());
}

void shade_occlusion(Wavefront& front, const PathState& path) {
  const Vertex& vertex = path.vertex;
  const SurfaceScene& surfaces = front.scene.surfaces;
  const Vector3d direction =
      frame_about(vertex.normal) * square_to_cosine_hemisphere(path.sampler.at_surface(1).direction);
  const Vector3d start = surfaces.start(vertex.hit, vertex.hit.lifted_position, vertex.side);
  if (!surfaces.occluded(start, direction)) ray_light(front, path) += path.throughput * vertex.reflectance;
}

}  // namespace

void shade_surface(Wavefront& front, PathState& path) {
  const Vertex& vertex = path.vertex;
  if (front.settings.shading == Shading::path) return follow_path(front, path);
  if (front.settings.shading == Shading::ambient_occlusion) return shade_occlusion(front, path);
  ray_light(front, path) +=
      path.throughput * (vertex.reflectance * -vertex.normal.dot(vertex.direction));  // Headlight.
}

}  // namespace tensorray
