// RayShader (shading.h): light that was traced to surfaces beforehand.

#include <cmath>

#include "base/constants.h"
#include "renderer/shading/shading.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t first_photon_dimension = 1u << 21;  ///< For passes of photons; one for each depth.

}  // namespace

void RayShader::add_landed_light(const Vertex& vertex, int depth) {
  for (const LandedLight& light : scene_.landed) {
    if (light.surface != vertex.hit.surface || !is_lit(light, vertex.hit.position, vertex.direction)) continue;
    const Vector3d wi = vertex.frame.transpose() * direction_towards(light, vertex.hit.position);
    evaluate(*vertex.material, reflectance_, wi, vertex.wo, contribution_, first_band());
    if (light.body) contribution_ *= std::abs(wi.z());
    weight_.setZero();
    add_irradiance(light, vertex.hit.position, weight_, first_band());
    contribution_ *= throughput_ * weight_;
    if (!(contribution_.maxCoeff() > 0)) continue;
    add_landed(depth, light.light);
  }
}

/// Adds `contribution_`, the light of a light that has landed.
void RayShader::add_landed(int depth, int light) {
  add(depth, {light});
  if (contribution_.allFinite())
    light_.col(column(ray_) + 1).segment(first_band(), contribution_.size()) += contribution_;
}

/// The pass from which a surface takes its photons: each sample takes one by chance, so that the noise of photons is
/// seen as that of samples.
const PhotonPass& RayShader::photon_pass(int depth) {
  PathSampler choice = sampler();
  choice.dimension = first_photon_dimension + static_cast<std::uint32_t>(depth);
  const std::vector<PhotonPass>& passes = scene_.photons->passes;
  return passes[static_cast<std::size_t>(choice.next_1d() * static_cast<double>(passes.size()))];
}

/// A diffuse surface scatters all photons of its side alike.
void RayShader::add_photons(const Vertex& vertex, int depth) {
  const PhotonPass& pass = photon_pass(depth);
  const bool is_diffuse = std::holds_alternative<Diffuse>(vertex.material->scattering);
  for (PhotonSum& sum : photon_sums_) sum.light = -1;
  pass.visit(vertex.hit, band_, [&](const LandedPhoton& photon, double density) {
    const Vector3d wi = vertex.frame.transpose() * -photon.direction.cast<double>();
    double scattered = density * photon.power;
    if (!is_diffuse) {
      evaluate(*vertex.material, reflectance_, wi, vertex.wo, contribution_, first_band());
      scattered *= contribution_[photon.band - first_band()];
    } else if (!(wi.z() * vertex.wo.z() > 0)) {
      return;
    }
    const bool is_of_area = photon.density > 0;
    if (is_of_area) scattered *= share_of_photon(vertex, photon, wi, pass.radius());
    const int group = scene_.groups > 0 ? scene_.group_of_light[static_cast<std::size_t>(photon.light)] : -1;
    PhotonSum& sum = photon_sums_[static_cast<std::size_t>(2 * (group + 1) + (is_of_area ? 1 : 0))];
    if (sum.light < 0) sum.scattered.setZero();
    sum.light = photon.light;
    sum.scattered[photon.band - first_band()] += scattered;
  });
  for (std::size_t i = 0; i < photon_sums_.size(); ++i) {
    const PhotonSum& sum = photon_sums_[i];
    if (sum.light < 0) continue;
    contribution_ = throughput_ * sum.scattered;
    if (is_diffuse) contribution_ *= reflectance_ / pi;
    if (i % 2 == 1)
      add(depth, {sum.light});
    else
      add_landed(depth, sum.light);
  }
}

// The light of an area light that comes through the region is found by aiming at the light, by the material, and by
// photons. With the power heuristic, each is weighted by the square of its density at the point, per steradian. That of
// photons is the number that is expected within their radius: density × π r² |cos θ|.

RayShader::PhotonRivalry RayShader::rivalry(const Vertex& vertex, const Vector3d& direction, double pdf, int depth) {
  PhotonRivalry result;
  if (!scene_.has_photons()) return result;
  const double radius = photon_pass(depth).radius();
  result.pdf = pdf;
  result.reach = pi * radius * radius * std::abs(direction.dot(vertex.hit.normal));
  result.surface = vertex.hit.surface;
  return result;
}

/// The part that remains for the technique of a ray that meets `hit`.
double RayShader::share_beside_photons(const WaitingRay& waiting, const BentWay& way, const SurfaceHit& hit) const {
  const PhotonRivalry& rivalry = waiting.rivalry;
  const int light = scene_.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(rivalry.reach > 0)) return 1;
  const auto& area = scene_.photons->areas[static_cast<std::size_t>(light)];
  if (!area || !area->surfaces[rivalry.surface]) return 1;
  const double density = area->count * area->emitter.density(hit.position, hit.normal, -way.direction);
  const double ratio = density * way.compression * rivalry.reach / rivalry.pdf;
  return 1 / (1 + waiting.weight * ratio * ratio);
}

double RayShader::share_of_photon(const Vertex& vertex, const LandedPhoton& photon, const Vector3d& wi,
                                  double radius) const {
  const Vector3d direction = -photon.direction.cast<double>();
  const double own = photon.density * pi * radius * radius * std::abs(direction.dot(vertex.hit.normal));
  if (!(own > 0)) return 0;
  // Where the photon is: seen from the vertex beside it, aim in its direction might miss the light.
  const double aimed = scene_.lights.direction_pdf(photon.position.cast<double>(), direction);
  const double scattered =
      settings_.direct == DirectLight::lights && aimed > 0 ? 0 : pdf(*vertex.material, reflectance_, wi, vertex.wo);
  const double by_light = (settings_.direct == DirectLight::material ? 0 : aimed) / own, by_material = scattered / own;
  return 1 / (1 + by_light * by_light + by_material * by_material);
}

}  // namespace tensorray
