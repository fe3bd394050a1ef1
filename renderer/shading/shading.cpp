#include "renderer/shading/shading.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "base/errors.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// First dimension of the sampler for shading; the camera uses those before.
constexpr std::uint32_t first_dimension = 2;
constexpr std::uint32_t dimensions_per_vertex = 5;

/// Least cosine between the shading normal and the direction to the viewer. Interpolated normals can place the viewer
/// below a surface that is seen from above.
constexpr double least_cosine = 0.01;

bool is_glass(const Material& material) { return std::holds_alternative<DielectricScattering>(material.scattering); }

Eigen::Map<const Eigen::ArrayXf> as_array(const std::vector<float>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// The shading normal on the side that `direction` comes from, turned so that the viewer is above the surface. Without
/// this, silhouettes of coarse meshes have black fringes. The geometric normal does not change.
Vector3d facing_normal(const SurfaceHit& hit, const Vector3d& direction, double side) {
  const Vector3d normal = side * hit.shading_normal;
  const double cosine = -normal.dot(direction), least = std::min(least_cosine, -side * hit.normal.dot(direction));
  return cosine < least ? Vector3d((normal + (cosine - least) * direction).normalized()) : normal;
}

}  // namespace

void require_shadable(const ShadedScene& scene, const ShadingSettings& settings) {
  require(settings.max_depth >= 0, "max_depth must be >= 0");
  require(settings.roulette_depth >= 1, "roulette_depth must be >= 1");
  require(settings.indirect_clamp >= 0, "indirect_clamp must be >= 0");
  require(settings.occlusion_distance > 0, "occlusion_distance must be > 0");
  for (std::size_t i = 0; i < scene.materials.size(); ++i)
    require(scene.materials[i].reflectance.size() == scene.colors.bands(),
            "material " + std::to_string(i) + " must have a reflectance for each band of the light");
  const std::vector<Light>& lights = scene.lights.lights();
  const auto is_area_light = [&](std::size_t i) { return std::holds_alternative<AreaLight>(lights[i]); };
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
}

/// A point where a path meets a surface. The frame is the material's: +z points outwards.
struct RayShader::Vertex {
  SurfaceHit hit;
  const Material* material;
  double side;     ///< 1: seen from outside, −1: from inside.
  Vector3d point;  ///< The point that is lit.
  Vector3d normal;
  Eigen::Matrix3d frame;
  Vector3d wo;

  /// Start of a ray towards `wi`.
  Vector3d start(const SurfaceScene& surfaces, const Vector3d& wi) const {
    return surfaces.start(hit, point, wi.z() * wo.z() < 0 ? -side : side);
  }
};

RayShader::RayShader(const ShadedScene& scene, const ShadingSettings& settings)
    : scene_(scene),
      settings_(settings),
      radiance_(scene.colors.bands()),
      throughput_(scene.colors.bands()),
      reflectance_(scene.colors.bands()),
      weight_(scene.colors.bands()),
      contribution_(scene.colors.bands()) {}

std::optional<FirstSurface> RayShader::shade(const Vector3d& origin, const Vector3d& direction, bool show_background,
                                             PathSampler& sampler) {
  radiance_.setZero();
  throughput_.setOnes();
  sampler.dimension = first_dimension;
  const std::optional<SurfaceHit> hit = scene_.surfaces.intersect(origin, direction);
  if (!hit) {
    if (show_background) add_background(direction, 1, 0);
    return std::nullopt;
  }
  const Vertex vertex = make_vertex(*hit, direction);
  switch (settings_.shading) {
    case Shading::path:
      add_emission(*hit, direction, 1, 0);
      shade_path(vertex, sampler);
      break;
    case Shading::ambient_occlusion:
      shade_occlusion(vertex, sampler);
      break;
    case Shading::headlight:
      radiance_ = reflectance_ * -vertex.normal.dot(direction);
      break;
  }
  return FirstSurface{*hit, vertex.normal};
}

/// Also sets `reflectance_`.
RayShader::Vertex RayShader::make_vertex(const SurfaceHit& hit, const Vector3d& direction) {
  Vertex vertex;
  vertex.hit = hit;
  vertex.material = &scene_.materials[scene_.surfaces.surfaces()[hit.surface].material];
  vertex.side = hit.normal.dot(direction) > 0 ? -1 : 1;
  vertex.point = is_glass(*vertex.material) ? hit.position : hit.lifted_position;
  vertex.normal = facing_normal(hit, direction, vertex.side);
  vertex.frame = frame_about(vertex.side * vertex.normal);
  vertex.wo = vertex.frame.transpose() * -direction;
  set_reflectance(hit, reflectance_);
  return vertex;
}

void RayShader::set_reflectance(const SurfaceHit& hit, BandValues& reflectance) const {
  const ShadedSurface& surface = scene_.surfaces.surfaces()[hit.surface];
  if (surface.colors.empty())
    reflectance = scene_.materials[surface.material].reflectance;
  else
    scene_.colors.reflectance(hit.color, reflectance);
}

/// Directions below the geometric surface but above the shaded one are followed like all others, from the lifted point.
/// They find the light that the surface itself does not block.
void RayShader::shade_path(Vertex vertex, PathSampler& sampler) {
  double refraction = 1;
  for (int depth = 1; depth <= settings_.max_depth; ++depth) {
    sampler.dimension = first_dimension + dimensions_per_vertex * static_cast<std::uint32_t>(depth - 1);
    add_direct_light(vertex, depth, sampler);
    const double lobe = sampler.next_1d();
    const Eigen::Vector2d place = sampler.next_2d();
    const auto scattered = sample(*vertex.material, reflectance_, vertex.wo, {lobe, place.x(), place.y()}, weight_);
    if (!scattered) return;
    throughput_ *= weight_;
    refraction *= scattered->refraction;
    const double survival = depth < settings_.roulette_depth ? 1 : std::min(0.95, throughput_.maxCoeff() / refraction);
    if (survival < 1) {
      if (!(sampler.next_1d() < survival)) return;
      throughput_ /= survival;
    }

    const Vector3d direction = vertex.frame * scattered->wi;
    const auto hit = scene_.surfaces.intersect(vertex.start(scene_.surfaces, scattered->wi), direction);
    if (!hit) {
      add_background(direction,
                     material_weight(scattered->pdf, [&] { return scene_.lights.background_pdf(direction); }), depth);
      return;
    }
    if (const int light = scene_.surfaces.surfaces()[hit->surface].light; light >= 0) {
      const auto light_pdf = [&] { return scene_.lights.area_pdf(light, vertex.point, hit->position, hit->normal); };
      add_emission(*hit, direction, material_weight(scattered->pdf, light_pdf), depth);
    }
    if (depth < settings_.max_depth) vertex = make_vertex(*hit, direction);
  }
}

/// Weight of light that a sampled direction has found.
template <class Density>
double RayShader::material_weight(double material_pdf, const Density& light_pdf) const {
  if (settings_.direct == DirectLight::lights) return 0;
  if (settings_.direct == DirectLight::material) return 1;
  const double ratio = light_pdf() / material_pdf;
  return 1 / (1 + ratio * ratio);
}

void RayShader::add_direct_light(const Vertex& vertex, int depth, PathSampler& sampler) {
  const double choice = sampler.next_1d();
  const Eigen::Vector2d place = sampler.next_2d();
  if (!scene_.lights.sample(vertex.point, choice, place, light_)) return;
  if (settings_.direct == DirectLight::material && !light_.is_delta) return;
  const Vector3d wi = vertex.frame.transpose() * light_.direction;
  evaluate(*vertex.material, reflectance_, wi, vertex.wo, contribution_);
  if (!(contribution_.maxCoeff() > 0)) return;
  if (is_shadowed(vertex.start(scene_.surfaces, wi), vertex.point)) return;
  double factor = std::abs(wi.z()) / light_.pdf;
  if (settings_.direct == DirectLight::both && !light_.is_delta) {
    const double ratio = pdf(*vertex.material, reflectance_, wi, vertex.wo) / light_.pdf;
    factor /= 1 + ratio * ratio;
  }
  contribution_ *= throughput_ * as_array(light_.radiance).cast<double>() * factor;
  add(depth);
}

/// Whether something blocks the light from `light_`, which was sampled from `point`. The ray starts a little off
/// `point`, so it must be aimed again at the position on the light: otherwise it would meet the light itself too early
/// where it is seen at a grazing angle.
bool RayShader::is_shadowed(const Vector3d& start, const Vector3d& point) const {
  if (std::isinf(light_.distance)) return scene_.surfaces.occluded(start, light_.direction);
  const Vector3d way = point + light_.distance * light_.direction - start;
  const double distance = way.norm();
  return distance > 0 && scene_.surfaces.occluded(start, way / distance, distance);
}

void RayShader::add_background(const Vector3d& direction, double weight, int depth) {
  if (!(weight > 0)) return;
  scene_.lights.background(direction, background_);
  contribution_ = throughput_ * as_array(background_).cast<double>() * weight;
  add(depth);
}

void RayShader::add_emission(const SurfaceHit& hit, const Vector3d& direction, double weight, int depth) {
  const int light = scene_.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(weight > 0)) return;
  const std::vector<float>* emitted = scene_.lights.emitted(light, hit.normal, direction);
  if (emitted == nullptr) return;
  contribution_ = throughput_ * as_array(*emitted).cast<double>() * weight;
  add(depth);
}

/// Adds light that was scattered `depth` times. Leaves out values that overflow, since one would make the mean
/// infinite.
void RayShader::add(int depth) {
  const double luminance = scene_.colors.luminance(contribution_);
  if (!std::isfinite(luminance)) return;
  if (depth >= 2 && settings_.indirect_clamp > 0 && luminance > settings_.indirect_clamp)
    contribution_ *= settings_.indirect_clamp / luminance;
  radiance_ += contribution_;
}

void RayShader::shade_occlusion(const Vertex& vertex, PathSampler& sampler) {
  const Vector3d direction = frame_about(vertex.normal) * square_to_cosine_hemisphere(sampler.next_2d());
  const Vector3d start = scene_.surfaces.start(vertex.hit, vertex.hit.lifted_position, vertex.side);
  if (!scene_.surfaces.occluded(start, direction, settings_.occlusion_distance)) radiance_ = reflectance_;
}

Eigen::Vector3f RayShader::albedo(const SurfaceHit& hit) {
  set_reflectance(hit, contribution_);
  const Material& material = scene_.materials[scene_.surfaces.surfaces()[hit.surface].material];
  if (const auto* metal = std::get_if<ConductorScattering>(&material.scattering)) contribution_ *= metal->mean_fresnel;
  return scene_.colors.color(contribution_);
}

}  // namespace tensorray
