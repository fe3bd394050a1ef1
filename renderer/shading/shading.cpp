#include "renderer/shading/shading.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "base/constants.h"
#include "base/errors.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// First dimension of the sampler for shading; the camera uses those before.
constexpr std::uint32_t first_dimension = 2;
constexpr std::uint32_t dimensions_per_vertex = 4;

/// Least cosine between the shading normal and the direction to the viewer. Interpolated normals can place the viewer
/// below a surface that is seen from above.
constexpr double least_cosine = 0.01;

/// The part of its light's luminance that a path must carry to go on in any case. Measured on tubes in a studio's light
/// (docs/dev/performance_notes.md): with 1/2 and 1/4 there is more noise for the time; with 1/16 it is the same.
constexpr double least_carried = 0.1;

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
  require(settings.pixel_angle >= 0, "pixel_angle must be >= 0");
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
  for (const int bands : {scene.bands_per_view, scene.bands_per_bounce})
    require(bands >= 1 && scene.colors.bands() % bands == 0,
            "bands_per_view and bands_per_bounce must divide the number of bands");
  for (const LandedLight& light : scene.landed)
    require(light.surface < scene.surfaces.surfaces().size() && light.bands == scene.colors.bands(),
            "landed light must have a surface and the bands of the light");
  require(scene.groups == 0 || scene.group_of_light.size() == lights.size(), "each light must have a group, or −1");
}

RayShader::RayShader(const ShadedScene& scene, const ShadingSettings& settings)
    : scene_(scene),
      settings_(settings),
      photon_sums_(static_cast<std::size_t>(2 * (scene.groups + 1))),
      albedo_(scene.colors.bands()),
      aims_bent_(scene.lights.is_concentrated()) {}

void RayShader::shade(const std::vector<ViewRay>& rays, bool show_background) {
  show_background_ = show_background;
  light_.setZero(static_cast<Eigen::Index>(scene_.colors.bands()), column(rays.size()));
  views_.assign(rays.size(), {});
  samplers_.clear();
  straight_.clear();
  waiting_.clear();
  for (const ViewRay& ray : rays) {
    samplers_.push_back(ray.sampler);
    straight_.push_back({ray.origin, ray.direction});
  }
  scene_.surfaces.intersect(straight_, hits_);
  for (ray_ = 0; ray_ < rays.size(); ++ray_) shade_view(straight_[ray_], hits_[ray_]);
  while (!waiting_.rays.empty()) {
    std::swap(waiting_, followed_);
    waiting_.clear();
    scene_.region->follow_back(followed_.ways);
    for (const WaitingRay& each : followed_.rays) {
      ray_ = each.ray;
      if (each.seeks_light)
        bring_light(each);
      else
        continue_path(each);
    }
  }
}

/// Begins a path with light of `band` alone; −1: of all bands. All that is computed for it has these bands only.
void RayShader::carry(int band) {
  band_ = band;
  const Eigen::Index bands = band < 0 ? scene_.colors.bands() : 1;
  if (throughput_.size() == bands) return;
  for (BandValues* values : {&throughput_, &reflectance_, &weight_, &contribution_}) values->resize(bands);
  for (PhotonSum& sum : photon_sums_) sum.scattered.resize(bands);
}

void RayShader::shade_view(const StraightRay& ray, const std::optional<SurfaceHit>& hit) {
  const auto& [origin, direction] = ray;
  carry(-1);
  throughput_.setOnes();
  stands_ = 1;
  sampler().dimension = first_dimension;
  if (bends(origin, direction, hit ? hit->distance : std::numeric_limits<double>::infinity()))
    return wait(origin, direction, throughput_, 0, 1, false, {});
  if (!hit) {
    if (show_background_) add_background(direction, 1, 0);
    return;
  }
  if (settings_.shading == Shading::path) add_emission(*hit, direction, 1, 0);
  const Vertex vertex = make_vertex(*hit, direction);
  views_[ray_].surface = FirstSurface{*hit, vertex.normal, direction};
  set_albedo(*views_[ray_].surface, reflectance_);
  shade_surface(vertex, 1);
}

/// @param depth  Number of surfaces that the path has met, with this one.
void RayShader::shade_surface(const Vertex& vertex, int depth) {
  switch (settings_.shading) {
    case Shading::path:
      return shade_path(vertex, depth);
    case Shading::ambient_occlusion:
      return shade_occlusion(vertex);
    case Shading::headlight:
      light_.col(column(ray_)) += throughput_ * (reflectance_ * -vertex.normal.dot(vertex.direction));
  }
}

/// @param reflectance  Of all bands.
void RayShader::set_albedo(FirstSurface& surface, const BandValues& reflectance) {
  albedo_ = reflectance;
  const Material& material = scene_.materials[scene_.surfaces.surfaces()[surface.hit.surface].material];
  if (const auto* metal = std::get_if<ConductorScattering>(&material.scattering)) albedo_ *= metal->mean_fresnel;
  surface.albedo = scene_.colors.color(albedo_);
}

/// Also sets `reflectance_`.
RayShader::Vertex RayShader::make_vertex(const SurfaceHit& hit, const Vector3d& direction) {
  Vertex vertex;
  vertex.hit = hit;
  vertex.direction = direction;
  vertex.material = &scene_.materials[scene_.surfaces.surfaces()[hit.surface].material];
  vertex.side = hit.normal.dot(direction) > 0 ? -1 : 1;
  vertex.point = is_glass(*vertex.material) ? hit.position : hit.lifted_position;
  vertex.normal = facing_normal(hit, direction, vertex.side);
  vertex.frame = frame_about(vertex.side * vertex.normal);
  vertex.wo = vertex.frame.transpose() * -direction;
  set_reflectance(hit, first_band(), reflectance_);
  vertex.view = viewed(*vertex.material, reflectance_, vertex.wo);
  return vertex;
}

/// @param reflectance  Of the bands from `first_band` on.
void RayShader::set_reflectance(const SurfaceHit& hit, Eigen::Index first_band, BandValues& reflectance) const {
  const ShadedSurface& surface = scene_.surfaces.surfaces()[hit.surface];
  if (surface.colors.empty() && !surface.texture)
    reflectance = scene_.materials[surface.material].reflectance.segment(first_band, reflectance.size());
  else
    scene_.colors.reflectance(hit.color, reflectance, first_band);
}

/// Directions below the geometric surface but above the shaded one are followed like all others, from the lifted point.
/// They find the light that the surface itself does not block.
void RayShader::shade_path(Vertex vertex, int depth) {
  PathSampler& sampler = this->sampler();
  double refraction = 1;
  for (; depth <= settings_.max_depth; ++depth) {
    sampler.dimension = first_dimension + dimensions_per_vertex * static_cast<std::uint32_t>(depth - 1);
    if (!scene_.landed.empty()) add_landed_light(vertex, depth);
    if (scene_.has_photons()) add_photons(vertex, depth);
    const SurfaceNumbers numbers = sampler.at_surface(depth);
    add_direct_light(vertex, numbers.light, depth);
    const double side = is_glass(*vertex.material) ? sampler.next_1d() : 0;
    const Vector3d u(numbers.direction.x(), numbers.direction.y(), side);
    const auto scattered = sample(*vertex.material, vertex.view, reflectance_, vertex.wo, u, weight_, first_band());
    if (!scattered) return;
    throughput_ *= weight_;
    refraction *= scattered->refraction;
    const double survival = depth < settings_.roulette_depth ? 1 : survives(refraction);
    if (survival < 1) {
      if (!(sampler.next_1d() < survival)) return;
      throughput_ /= survival;
    }

    const Vector3d direction = vertex.frame * scattered->wi;
    const Vector3d start = vertex.start(scene_.surfaces, scattered->wi);
    const auto hit = scene_.surfaces.intersect(start, direction);
    if (bends(start, direction, hit ? hit->distance : std::numeric_limits<double>::infinity())) {
      const auto light_pdf = [&] { return scene_.lights.direction_pdf(vertex.point, direction); };
      const double weight = aims_bent_ ? material_weight(scattered->pdf, light_pdf) : 1;
      return wait(start, direction, throughput_, depth, weight, false,
                  rivalry(vertex, direction, scattered->pdf, depth));
    }
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

/// The probability with which the path goes on. Light that would hardly be seen is followed rarely: the brightness of
/// what the path still carries decides.
double RayShader::survives(double refraction) const {
  const double carried = band_ < 0 ? scene_.colors.luminance(throughput_) : throughput_[0] / stands_;
  return std::min(1.0, carried / (least_carried * refraction));
}

/// Weight of light that a sampled direction has found.
template <class Density>
double RayShader::material_weight(double material_pdf, const Density& light_pdf) const {
  if (settings_.direct == DirectLight::material) return 1;
  if (settings_.direct == DirectLight::lights) return light_pdf() > 0 ? 0 : 1;
  const double ratio = light_pdf() / material_pdf;
  return 1 / (1 + ratio * ratio);
}

/// @param u  In [0, 1)².
void RayShader::add_direct_light(const Vertex& vertex, const Eigen::Vector2d& u, int depth) {
  if (!scene_.lights.sample(vertex.point, u, light_sample_, bands())) return;
  if (settings_.direct == DirectLight::material && !light_sample_.is_delta) return;
  const Vector3d wi = vertex.frame.transpose() * light_sample_.direction;
  const double material_pdf =
      evaluate(*vertex.material, vertex.view, reflectance_, wi, vertex.wo, contribution_, first_band());
  if (!(contribution_.maxCoeff() > 0)) return;
  const Vector3d start = vertex.start(scene_.surfaces, wi);
  if (bends(start, light_sample_.direction, light_sample_.distance)) return seek_bent_light(vertex, wi, start, depth);
  if (is_shadowed(start, vertex.point)) return;
  double factor = std::abs(wi.z()) / light_sample_.pdf;
  if (settings_.direct == DirectLight::both && !light_sample_.is_delta) {
    const double ratio = material_pdf / light_sample_.pdf;
    factor /= 1 + ratio * ratio;
  }
  contribution_ *= throughput_ * as_array(light_sample_.radiance).cast<double>() * factor;
  add(depth, {light_sample_.light, light_sample_.direction, true, &light_sample_.radiance});
}

/// Whether something blocks the light from `light_sample_`, which was sampled from `point`. The ray starts a little off
/// `point`, so it must be aimed again at the position on the light: otherwise it would meet the light itself too early
/// where it is seen at a grazing angle.
bool RayShader::is_shadowed(const Vector3d& start, const Vector3d& point) const {
  if (std::isinf(light_sample_.distance)) return scene_.surfaces.occluded(start, light_sample_.direction);
  const Vector3d way = point + light_sample_.distance * light_sample_.direction - start;
  const double distance = way.norm();
  return distance > 0 && scene_.surfaces.occluded(start, way / distance, distance);
}

void RayShader::add_background(const Vector3d& direction, double weight, int depth, bool disks) {
  if (!(weight > 0)) return;
  scene_.lights.background(direction, background_, disks, -1, bands());
  contribution_ = throughput_ * as_array(background_).cast<double>() * weight;
  add(depth, {-1, direction, disks, &background_});
}

void RayShader::add_emission(const SurfaceHit& hit, const Vector3d& direction, double weight, int depth) {
  const int light = scene_.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(weight > 0)) return;
  const std::vector<float>* emitted = scene_.lights.emitted(light, hit.normal, direction);
  if (emitted == nullptr) return;
  contribution_ = throughput_ * as_array(*emitted).segment(first_band(), throughput_.size()).cast<double>() * weight;
  add(depth, {light});
}

/// Adds light that was scattered `depth` times. Leaves out values that overflow, since one would make the mean
/// infinite.
void RayShader::add(int depth, const LightSource& source) {
  const double brightness = band_ < 0 ? scene_.colors.luminance(contribution_) : contribution_[0] / stands_;
  if (!std::isfinite(brightness)) return;
  if (depth >= 2 && settings_.indirect_clamp > 0 && brightness > settings_.indirect_clamp)
    contribution_ *= settings_.indirect_clamp / brightness;
  light_.col(column(ray_)).segment(first_band(), contribution_.size()) += contribution_;
  if (scene_.groups > 0) add_to_groups(source);
}

/// The background's light is divided as the radiances of its lights.
void RayShader::add_to_groups(const LightSource& source) {
  const Eigen::Index first = column(ray_ + 1) - scene_.groups;
  const auto group_of = [&](int light) { return scene_.group_of_light[static_cast<std::size_t>(light)]; };
  const auto layer_of = [&](int light) {
    return light_.col(first + group_of(light)).segment(first_band(), contribution_.size());
  };
  if (source.light >= 0) {
    if (group_of(source.light) >= 0) layer_of(source.light) += contribution_;
    return;
  }
  for (int light = 0; light < static_cast<int>(scene_.group_of_light.size()); ++light) {
    if (group_of(light) < 0) continue;
    scene_.lights.background(source.direction, of_one_light_, source.disks, light, bands());
    auto layer = layer_of(light);
    for (std::size_t band = 0; band < of_one_light_.size(); ++band)
      if (of_one_light_[band] > 0)
        layer[static_cast<Eigen::Index>(band)] +=
            contribution_[static_cast<Eigen::Index>(band)] * of_one_light_[band] / (*source.radiance)[band];
  }
}

void RayShader::shade_occlusion(const Vertex& vertex) {
  const Vector3d direction =
      frame_about(vertex.normal) * square_to_cosine_hemisphere(sampler().at_surface(1).direction);
  const Vector3d start = scene_.surfaces.start(vertex.hit, vertex.hit.lifted_position, vertex.side);
  if (!scene_.surfaces.occluded(start, direction, settings_.occlusion_distance))
    light_.col(column(ray_)) += throughput_ * reflectance_;
}

}  // namespace tensorray
