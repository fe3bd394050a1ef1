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
constexpr std::uint32_t dimensions_per_vertex = 5;
constexpr std::uint32_t first_bent_dimension = 1u << 20;    ///< For wavelengths within their bands; one for each depth.
constexpr std::uint32_t first_photon_dimension = 1u << 21;  ///< For passes of photons; one for each depth.

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
  for (const int bands : {scene.bands_per_view, scene.bands_per_bounce})
    require(bands >= 1 && scene.colors.bands() % bands == 0,
            "bands_per_view and bands_per_bounce must divide the number of bands");
  for (const LandedLight& light : scene.landed)
    require(light.surface < scene.surfaces.surfaces().size() && light.bands == scene.colors.bands(),
            "landed light must have a surface and the bands of the light");
  require(scene.groups == 0 || scene.group_of_light.size() == lights.size(), "each light must have a group, or −1");
}

/// A point where a path meets a surface. The frame is the material's: +z points outwards.
struct RayShader::Vertex {
  SurfaceHit hit;
  const Material* material;
  double side;     ///< 1: seen from outside, −1: from inside.
  Vector3d point;  ///< The point that is lit.
  Vector3d normal;
  Vector3d direction;  ///< Of the ray that found it.
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
      contribution_(scene.colors.bands()),
      layers_(static_cast<std::size_t>(scene.layers()), BandValues(scene.colors.bands())),
      photon_sums_(static_cast<std::size_t>(scene.groups + 1), {BandValues(scene.colors.bands())}),
      aims_bent_(scene.lights.is_concentrated()) {}

std::optional<FirstSurface> RayShader::shade(const Vector3d& origin, const Vector3d& direction, bool show_background,
                                             PathSampler& sampler) {
  radiance_.setZero();
  for (BandValues& layer : layers_) layer.setZero();
  throughput_.setOnes();
  bent_view_.reset();
  band_ = -1;
  share_ = 1;
  sampler.dimension = first_dimension;
  const std::optional<SurfaceHit> hit = scene_.surfaces.intersect(origin, direction);
  if (bends(origin, direction, hit ? hit->distance : std::numeric_limits<double>::infinity()))
    return shade_bent(origin, direction, 0, 1, show_background, sampler);
  if (!hit) {
    if (show_background) add_background(direction, 1, 0);
    return std::nullopt;
  }
  if (settings_.shading == Shading::path) add_emission(*hit, direction, 1, 0);
  const Vertex vertex = make_vertex(*hit, direction);
  const FirstSurface surface = first_surface(vertex);
  shade_surface(vertex, 1, sampler);
  return surface;
}

/// @param depth  Number of surfaces that the path has met, with this one.
void RayShader::shade_surface(const Vertex& vertex, int depth, PathSampler& sampler) {
  switch (settings_.shading) {
    case Shading::path:
      return shade_path(vertex, depth, sampler);
    case Shading::ambient_occlusion:
      return shade_occlusion(vertex, sampler);
    case Shading::headlight:
      radiance_ += throughput_ * (reflectance_ * -vertex.normal.dot(vertex.direction));
  }
}

/// Needs the vertex's `reflectance_`.
FirstSurface RayShader::first_surface(const Vertex& vertex) {
  contribution_ = reflectance_;
  if (const auto* metal = std::get_if<ConductorScattering>(&vertex.material->scattering))
    contribution_ *= metal->mean_fresnel;
  return {vertex.hit, vertex.normal, vertex.direction, scene_.colors.color(contribution_)};
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
  set_reflectance(hit, reflectance_);
  return vertex;
}

void RayShader::set_reflectance(const SurfaceHit& hit, BandValues& reflectance) const {
  const ShadedSurface& surface = scene_.surfaces.surfaces()[hit.surface];
  if (surface.colors.empty() && !surface.texture)
    reflectance = scene_.materials[surface.material].reflectance;
  else
    scene_.colors.reflectance(hit.color, reflectance);
}

/// Directions below the geometric surface but above the shaded one are followed like all others, from the lifted point.
/// They find the light that the surface itself does not block.
void RayShader::shade_path(Vertex vertex, int depth, PathSampler& sampler) {
  double refraction = 1;
  for (; depth <= settings_.max_depth; ++depth) {
    sampler.dimension = first_dimension + dimensions_per_vertex * static_cast<std::uint32_t>(depth - 1);
    if (!scene_.landed.empty()) add_landed_light(vertex, depth);
    if (scene_.has_photons()) add_photons(vertex, depth, sampler);
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
    const Vector3d start = vertex.start(scene_.surfaces, scattered->wi);
    const auto hit = scene_.surfaces.intersect(start, direction);
    if (bends(start, direction, hit ? hit->distance : std::numeric_limits<double>::infinity())) {
      const auto light_pdf = [&] { return scene_.lights.direction_pdf(vertex.point, direction); };
      const double weight = aims_bent_ ? material_weight(scattered->pdf, light_pdf) : 1;
      shade_bent(start, direction, depth, weight, true, sampler);
      return;
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

/// Whether a ray enters the region before it meets something at `distance`.
bool RayShader::bends(const Vector3d& origin, const Vector3d& direction, double distance) const {
  return scene_.region && scene_.region->entry(origin, direction) < distance;
}

/// The number of bands for which one that is followed into the region stands.
double RayShader::bands_per_followed(int depth) const {
  if (band_ >= 0) return 1;
  return static_cast<double>(throughput_.size()) / (depth == 0 ? scene_.bands_per_view : scene_.bands_per_bounce);
}

/// Follows a ray into the region, for the band of the path; for a path of all bands, for some of them, evenly spaced.
/// Successive samples of a pixel take different bands.
std::vector<BentWay> RayShader::follow_ways(const Vector3d& origin, const Vector3d& direction, int depth,
                                            const PathSampler& sampler) const {
  PathSampler places = sampler;
  places.dimension = first_bent_dimension + static_cast<std::uint32_t>(depth);
  BentWay way;
  way.place = places.next_1d();
  std::vector<BentWay> ways;
  const double share = bands_per_followed(depth);
  const int bands = static_cast<int>(throughput_.size()), parts = static_cast<int>(share);
  const int first = static_cast<int>((sampler.pixel + sampler.sample) % static_cast<std::uint64_t>(parts));
  for (int band = band_ < 0 ? first : band_; band < bands; band += band_ < 0 ? parts : bands) {
    if (!(throughput_[band] > 0)) continue;
    way.band = band;
    ways.push_back(way);
  }
  scene_.region->follow_back(origin, direction, ways);
  for (BentWay& each : ways) each.gain *= share;
  return ways;
}

/// Continues a path that enters the region as a path for each band.
/// @param depth   Number of surfaces that the path has met.
/// @param weight  Of the light that it meets next.
/// @return the surface that the middle one of the bands meets.
std::optional<FirstSurface> RayShader::shade_bent(const Vector3d& origin, const Vector3d& direction, int depth,
                                                  double weight, bool show_background, PathSampler& sampler) {
  const std::vector<BentWay> ways = follow_ways(origin, direction, depth, sampler);
  const BandValues before = throughput_;
  const int band_before = band_;
  const double share_before = share_, share = bands_per_followed(depth);
  share_ *= share;
  const bool is_view = depth == 0;
  std::optional<FirstSurface> seen;
  BentView view{0, 0, 0};
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const BentWay& way = ways[i];
    if (is_view && way.arrives) {
      view.gain += way.gain / share / static_cast<double>(ways.size());
      view.deflection += std::atan2(way.direction.cross(direction).norm(), way.direction.dot(direction)) /
                         static_cast<double>(ways.size());
      view.arrives += 1 / static_cast<double>(ways.size());
    }
    if (!way.arrives) continue;
    band_ = way.band;
    throughput_.setZero();
    throughput_[way.band] = before[way.band] * way.gain;
    const auto hit = surface_at_end(scene_.surfaces, way);
    if (!hit) {
      if (show_background) add_background(way.direction, weight, depth, is_view);
      continue;
    }
    if (settings_.shading == Shading::path) add_emission(*hit, way.direction, weight, depth);
    if (!is_view && depth == settings_.max_depth) continue;
    const Vertex vertex = make_vertex(*hit, way.direction);
    if (is_view && i <= ways.size() / 2) seen = first_surface(vertex);
    shade_surface(vertex, depth + 1, sampler);
  }
  throughput_ = before;
  band_ = band_before;
  share_ = share_before;
  if (is_view) bent_view_ = view;
  return seen;
}

/// Follows the direction of `light_` through the region and adds the light that it meets, whatever that is: the density
/// is that of the direction at the surface, so that bending does not change it. Needs f in `contribution_`.
void RayShader::add_bent_light(const Vertex& vertex, const Vector3d& wi, const Vector3d& start, int depth,
                               const PathSampler& sampler) {
  if (!aims_bent_ || light_.is_delta) return;
  const Vector3d& direction = light_.direction;
  const double density = scene_.lights.direction_pdf(vertex.point, direction);
  if (!(density > 0)) return;
  if (scene_.surfaces.occluded(start, direction, scene_.region->entry(start, direction))) return;
  double factor = std::abs(wi.z()) / density;
  if (settings_.direct == DirectLight::both) {
    const double ratio = pdf(*vertex.material, reflectance_, wi, vertex.wo) / density;
    factor /= 1 + ratio * ratio;
  }
  const BandValues scattered = factor * contribution_ * throughput_;
  const int band_before = band_;
  const double share_before = share_;
  share_ *= bands_per_followed(depth);
  for (const BentWay& way : follow_ways(start, direction, depth, sampler)) {
    if (!way.arrives) continue;
    const auto hit = surface_at_end(scene_.surfaces, way);
    const int light = hit ? scene_.surfaces.surfaces()[hit->surface].light : -1;
    if (hit && light < 0) continue;
    if (!hit) scene_.lights.background(way.direction, background_, false);
    const std::vector<float>* const found =
        hit ? scene_.lights.emitted(light, hit->normal, way.direction) : &background_;
    if (!found) continue;
    band_ = way.band;
    contribution_.setZero();
    contribution_[way.band] = scattered[way.band] * way.gain * (*found)[static_cast<std::size_t>(way.band)];
    add(depth, {light, way.direction, false, found});
  }
  band_ = band_before;
  share_ = share_before;
}

void RayShader::add_landed_light(const Vertex& vertex, int depth) {
  for (const LandedLight& light : scene_.landed) {
    if (light.surface != vertex.hit.surface || !is_lit(light, vertex.hit.position, vertex.direction)) continue;
    const Vector3d wi = vertex.frame.transpose() * direction_towards(light, vertex.hit.position);
    evaluate(*vertex.material, reflectance_, wi, vertex.wo, contribution_);
    if (light.body) contribution_ *= std::abs(wi.z());
    weight_.setZero();
    add_irradiance(light, vertex.hit.position, weight_);
    contribution_ *= throughput_ * weight_;
    if (!(contribution_.maxCoeff() > 0)) continue;
    add_landed(depth, light.light);
  }
}

/// Adds `contribution_`, the light of a light that has landed.
void RayShader::add_landed(int depth, int light) {
  add(depth, {light});
  if (contribution_.allFinite()) layers_.front() += contribution_;
}

/// A diffuse surface scatters all photons of its side alike. Each sample takes a pass by chance, so that the noise of
/// photons is seen as that of samples.
void RayShader::add_photons(const Vertex& vertex, int depth, PathSampler sampler) {
  sampler.dimension = first_photon_dimension + static_cast<std::uint32_t>(depth);
  const std::vector<PhotonPass>& passes = *scene_.photons;
  const auto pass = static_cast<std::size_t>(sampler.next_1d() * static_cast<double>(passes.size()));
  const bool is_diffuse = std::holds_alternative<Diffuse>(vertex.material->scattering);
  for (PhotonSum& sum : photon_sums_) sum.light = -1;
  passes[pass].visit(vertex.hit, band_, [&](const LandedPhoton& photon, double density) {
    const Vector3d wi = vertex.frame.transpose() * -photon.direction.cast<double>();
    double scattered = density * photon.power;
    if (!is_diffuse) {
      evaluate(*vertex.material, reflectance_, wi, vertex.wo, contribution_);
      scattered *= contribution_[photon.band];
    } else if (!(wi.z() * vertex.wo.z() > 0)) {
      return;
    }
    const int group = scene_.groups > 0 ? scene_.group_of_light[static_cast<std::size_t>(photon.light)] : -1;
    PhotonSum& sum = photon_sums_[static_cast<std::size_t>(group + 1)];
    if (sum.light < 0) sum.scattered.setZero();
    sum.light = photon.light;
    sum.scattered[photon.band] += scattered;
  });
  for (const PhotonSum& sum : photon_sums_) {
    if (sum.light < 0) continue;
    contribution_ = throughput_ * sum.scattered;
    if (is_diffuse) contribution_ *= reflectance_ / pi;
    add_landed(depth, sum.light);
  }
}

/// Weight of light that a sampled direction has found.
template <class Density>
double RayShader::material_weight(double material_pdf, const Density& light_pdf) const {
  if (settings_.direct == DirectLight::material) return 1;
  if (settings_.direct == DirectLight::lights) return light_pdf() > 0 ? 0 : 1;
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
  const Vector3d start = vertex.start(scene_.surfaces, wi);
  if (bends(start, light_.direction, light_.distance)) return add_bent_light(vertex, wi, start, depth, sampler);
  if (is_shadowed(start, vertex.point)) return;
  double factor = std::abs(wi.z()) / light_.pdf;
  if (settings_.direct == DirectLight::both && !light_.is_delta) {
    const double ratio = pdf(*vertex.material, reflectance_, wi, vertex.wo) / light_.pdf;
    factor /= 1 + ratio * ratio;
  }
  contribution_ *= throughput_ * as_array(light_.radiance).cast<double>() * factor;
  add(depth, {light_.light, light_.direction, true, &light_.radiance});
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

void RayShader::add_background(const Vector3d& direction, double weight, int depth, bool disks) {
  if (!(weight > 0)) return;
  scene_.lights.background(direction, background_, disks);
  contribution_ = throughput_ * as_array(background_).cast<double>() * weight;
  add(depth, {-1, direction, disks, &background_});
}

void RayShader::add_emission(const SurfaceHit& hit, const Vector3d& direction, double weight, int depth) {
  const int light = scene_.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(weight > 0)) return;
  const std::vector<float>* emitted = scene_.lights.emitted(light, hit.normal, direction);
  if (emitted == nullptr) return;
  contribution_ = throughput_ * as_array(*emitted).cast<double>() * weight;
  add(depth, {light});
}

/// Adds light that was scattered `depth` times. Leaves out values that overflow, since one would make the mean
/// infinite.
void RayShader::add(int depth, const LightSource& source) {
  const double brightness = band_ < 0 ? scene_.colors.luminance(contribution_) : contribution_[band_] / share_;
  if (!std::isfinite(brightness)) return;
  if (depth >= 2 && settings_.indirect_clamp > 0 && brightness > settings_.indirect_clamp)
    contribution_ *= settings_.indirect_clamp / brightness;
  radiance_ += contribution_;
  if (scene_.groups > 0) add_to_groups(source);
}

/// The background's light is divided as the radiances of its lights.
void RayShader::add_to_groups(const LightSource& source) {
  const std::size_t first = layers_.size() - static_cast<std::size_t>(scene_.groups);
  const auto group_of = [&](int light) { return scene_.group_of_light[static_cast<std::size_t>(light)]; };
  if (source.light >= 0) {
    if (group_of(source.light) >= 0) layers_[first + group_of(source.light)] += contribution_;
    return;
  }
  for (int light = 0; light < static_cast<int>(scene_.group_of_light.size()); ++light) {
    if (group_of(light) < 0) continue;
    scene_.lights.background(source.direction, of_one_light_, source.disks, light);
    BandValues& layer = layers_[first + group_of(light)];
    for (std::size_t band = 0; band < of_one_light_.size(); ++band)
      if (of_one_light_[band] > 0)
        layer[static_cast<Eigen::Index>(band)] +=
            contribution_[static_cast<Eigen::Index>(band)] * of_one_light_[band] / (*source.radiance)[band];
  }
}

void RayShader::shade_occlusion(const Vertex& vertex, PathSampler& sampler) {
  const Vector3d direction = frame_about(vertex.normal) * square_to_cosine_hemisphere(sampler.next_2d());
  const Vector3d start = scene_.surfaces.start(vertex.hit, vertex.hit.lifted_position, vertex.side);
  if (!scene_.surfaces.occluded(start, direction, settings_.occlusion_distance))
    radiance_ += throughput_ * reflectance_;
}

}  // namespace tensorray
