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
  if (contribution_.allFinite()) light_.col(column(ray_) + 1) += contribution_;
}

/// A diffuse surface scatters all photons of its side alike. Each sample takes a pass by chance, so that the noise of
/// photons is seen as that of samples.
void RayShader::add_photons(const Vertex& vertex, int depth) {
  PathSampler sampler = this->sampler();
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

}  // namespace tensorray
