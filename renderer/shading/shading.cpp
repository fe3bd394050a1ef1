#include "renderer/shading/shading.h"

#include <set>
#include <string>

#include "base/errors.h"
#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// Least cosine between the shading normal and the direction to the viewer. Interpolated normals can place the viewer
/// below a surface that is seen from above.
constexpr double min_cosine = 0.01;

/// The shading normal on the side that `direction` comes from, turned so that the viewer is above the surface. Without
/// this, silhouettes of coarse meshes have black fringes. The geometric normal does not change.
Vector3d facing_normal(const SurfaceHit& hit, const Vector3d& direction, double side) {
  const Vector3d normal = side * hit.shading_normal;
  const double cosine = -normal.dot(direction), least = std::min(min_cosine, -side * hit.normal.dot(direction));
  return cosine < least ? Vector3d((normal + (cosine - least) * direction).normalized()) : normal;
}

const Material& material_of(const ShadedScene& scene, const SurfaceHit& hit) {
  return scene.materials[scene.surfaces.surfaces()[hit.surface].material + hit.roughness_step];
}

/// Begins to shade `rays`, and finds the surfaces that they meet if they are not bent.
void find_surfaces(Wavefront& front, const std::vector<ViewRay>& rays) {
  front.light.setZero(front.scene.colors.bands(), front.column(rays.size()));
  front.views.assign(rays.size(), {});
  front.samplers.clear();
  front.straight.clear();
  front.waiting.clear();
  for (const ViewRay& ray : rays) {
    front.samplers.push_back(ray.sampler);
    front.straight.push_back({ray.origin, ray.direction});
  }
  front.scene.surfaces.intersect(front.straight, front.hits);
}

/// Follows the path of a ray of the camera until it ends, or waits at the region.
void shade_view(Wavefront& front, std::size_t number, PathState& path) {
  const ShadedScene& scene = front.scene;
  const StraightRay& ray = front.straight[number];
  const std::optional<SurfaceHit>& hit = front.hits[number];
  path.ray = number;
  path.sampler = front.samplers[number];
  path.depth = 0;
  path.band = -1;
  path.stands_for = 1;
  path.throughput.setOnes(scene.colors.bands());
  if (enters_region(scene, ray, hit ? hit->distance : std::numeric_limits<double>::infinity()))
    return wait_at_region(front, path, ray, path.throughput, {});
  if (!hit) {
    if (front.show_background) add_background(front, path, ray.direction, 1);
    return;
  }
  if (front.settings.shading == Shading::path) add_emission(front, path, *hit, ray.direction, 1);
  meet_surface(scene, *hit, ray.direction, path);
  front.memory.albedo = path.vertex.reflectance;
  front.views[number].surface =
      FirstSurface{*hit, path.vertex.normal, ray.direction, albedo(scene, *hit, front.memory.albedo)};
  shade_surface(front, path);
}

}  // namespace

void set_reflectance(const ShadedScene& scene, const SurfaceHit& hit, Eigen::Index first_band,
                     BandValues& reflectance) {
  const ShadedSurface& surface = scene.surfaces.surfaces()[hit.surface];
  const bool has_picture = surface.texture || (surface.pictures && !surface.pictures->color.pixels.empty());
  if (surface.colors.empty() && !has_picture)
    reflectance = scene.materials[surface.material].reflectance.segment(first_band, reflectance.size());
  else
    scene.colors.reflectance(hit.color, reflectance, first_band);
}

void meet_surface(const ShadedScene& scene, const SurfaceHit& hit, const Vector3d& direction, PathState& path) {
  ++path.depth;
  Vertex& vertex = path.vertex;
  vertex.hit = hit;
  vertex.direction = direction;
  vertex.material = &material_of(scene, hit);
  vertex.side = hit.normal.dot(direction) > 0 ? -1 : 1;
  vertex.point = is_glass(*vertex.material) ? hit.position : hit.lifted_position;
  vertex.normal = facing_normal(hit, direction, vertex.side);
  vertex.frame = frame_about(vertex.side * vertex.normal);
  vertex.reflectance.resize(path.throughput.size());
  set_reflectance(scene, hit, path.first_band(), vertex.reflectance);
  vertex.view = viewed(*vertex.material, vertex.reflectance, vertex.to_local(-direction), path.first_band());
}

Eigen::Vector3f albedo(const ShadedScene& scene, const SurfaceHit& hit, BandValues& reflectance) {
  if (const BandValues* const fresnel = mean_fresnel(material_of(scene, hit))) reflectance *= *fresnel;
  return scene.colors.color(reflectance).cast<float>();
}

void require_shadable(const ShadedScene& scene, const ShadingSettings& settings) {
  require(settings.max_depth >= 0, "max_depth must be >= 0");
  require(settings.roulette_depth >= 1, "roulette_depth must be >= 1");
  require(settings.indirect_clamp >= 0, "indirect_clamp must be >= 0");
  require(settings.pixel_angle >= 0, "pixel_angle must be >= 0");
  for (std::size_t i = 0; i < scene.materials.size(); ++i)
    require(scene.materials[i].reflectance.size() == scene.colors.bands(),
            "material " + std::to_string(i) + " must have a reflectance for each band of the light");
  const std::vector<Light>& lights = scene.lights.lights();
  const auto is_area_light = [&](std::size_t i) { return emitting_mesh(lights[i]) != nullptr; };
  std::set<std::size_t> found;
  for (std::size_t i = 0; i < scene.surfaces.surfaces().size(); ++i) {
    const ShadedSurface& surface = scene.surfaces.surfaces()[i];
    const std::string name = "surface " + std::to_string(i);
    require(static_cast<std::size_t>(surface.material) < scene.materials.size(), name + " has no material");
    if (surface.light < 0) continue;
    const auto light = static_cast<std::size_t>(surface.light);
    require(light < lights.size() && is_area_light(light), name + " must be that of an area light");
    found.insert(light);
  }
  for (std::size_t i = 0; i < lights.size(); ++i)
    require(!is_area_light(i) || found.count(i), "light " + std::to_string(i) + " must have a surface of its mesh");
  for (const int bands : {scene.bands_per_view, scene.bands_per_bounce})
    require(bands >= 1 && scene.colors.bands() % bands == 0,
            "bands_per_view and bands_per_bounce must divide the number of bands");
  for (const IrradianceMap& light : scene.irradiance_maps)
    require(light.surface < scene.surfaces.surfaces().size() && light.bands == scene.colors.bands(),
            "irradiance maps must have a surface and the bands of the light");
  require(scene.groups == 0 || scene.group_of_light.size() == lights.size(), "each light must have a group, or −1");
}

RayShader::RayShader(const ShadedScene& scene, const ShadingSettings& settings)
    : front_(new Wavefront(scene, settings)) {}

RayShader::RayShader(RayShader&&) noexcept = default;
RayShader::~RayShader() = default;

void RayShader::shade(const std::vector<ViewRay>& rays, bool show_background) {
  Wavefront& front = *front_;
  front.show_background = show_background;
  find_surfaces(front, rays);
  PathState path;
  for (std::size_t ray = 0; ray < rays.size(); ++ray) shade_view(front, ray, path);
  while (!front.waiting.paths.empty()) {
    trace_bent_rays(front);
    continue_paths(front, path);
  }
}

Eigen::ArrayXXd::ConstColXpr RayShader::layer(std::size_t ray, int layer) const {
  const Wavefront& front = *front_;
  return front.light.col(front.column(ray) + 1 + layer);
}

const RayView& RayShader::view(std::size_t ray) const { return front_->views[ray]; }

}  // namespace tensorray
