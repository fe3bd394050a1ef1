#include "renderer/materials/principled.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tensorray {
namespace {

constexpr double coat_index = 1.5;

/// Schlick's reflectance under uniform light; the mean of his fifth power is 1/21.
double mean_schlick(double normal_reflectance) { return (20 * normal_reflectance + 1) / 21; }

double fraction(double value, const char* parameter) {
  if (!(value >= 0 && value <= 1))
    throw std::invalid_argument(std::string(parameter) + " is " + std::to_string(value) + "; give a value in 0..1");
  return value;
}

/// The fraction that the coat transmits on the way in and out. The smaller of the two is reciprocal. Over a smooth
/// metal both cosines are equal, and it is exactly what the coat does not reflect.
double through_coat(const PrincipledScattering& layers, double cosine_o, double cosine_i) {
  return 1 - std::max(layers.coat.at(cosine_o), layers.coat.at(cosine_i));
}

/// The fraction that the coat and a base with this Fresnel reflectance do not reflect in one bounce.
template <class Fresnel>
CosineTable missing_table(const PrincipledScattering& layers, const Fresnel& fresnel) {
  return make_cosine_table(std::min(layers.alpha, layers.coat_alpha), [&](double cosine) {
    const double base = visible_mean(layers.alpha, cosine, [&](const Eigen::Vector3d& wo, const Eigen::Vector3d& m) {
      const Eigen::Vector3d wi = mirrored(wo, m);
      if (wi.z() <= 0) return 0.0;
      return fresnel(std::min(1.0, wo.dot(m))) * ggx_shadowing(layers.alpha, wo.z(), wi.z()) *
             through_coat(layers, wo.z(), wi.z());
    });
    return 1 - layers.coat.at(cosine) - base;
  });
}

/// Sampling probability of each lobe, in proportion to what it scatters in the brightest band, so that no weight is
/// large.
struct LobeShares {
  double coat;
  double base;
  double dielectric_fill;
  double metal_fill;
};

LobeShares lobe_shares(const PrincipledScattering& layers, const BandsIn& reflectance, double cosine_o) {
  const double metallic = layers.metallic, brightest = reflectance.size() > 0 ? reflectance.maxCoeff() : 0;
  const double coat = layers.coat.at(cosine_o);
  const double dielectric = layers.missing_dielectric.at(cosine_o), metal = layers.missing_metal.at(cosine_o);
  LobeShares shares{};
  shares.coat = coat;
  shares.base = std::max(1e-3, (1 - metallic) * (1 - coat - dielectric) +
                                   metallic * (1 - coat - metal) * fresnel_schlick(cosine_o, brightest));
  shares.dielectric_fill = (1 - metallic) * brightest * dielectric;
  shares.metal_fill = metallic * metal * fill_color(mean_schlick(brightest), layers.missing_metal.mean());
  const double sum = shares.coat + shares.base + shares.dielectric_fill + shares.metal_fill;
  return {shares.coat / sum, shares.base / sum, shares.dielectric_fill / sum, shares.metal_fill / sum};
}

}  // namespace

PrincipledScattering prepare(const Principled& settings) {
  PrincipledScattering layers;
  layers.metallic = fraction(settings.metallic, "the material's metallic");
  layers.alpha = ggx_alpha(settings.roughness, "the material's roughness");
  layers.clearcoat = fraction(settings.clearcoat, "the material's clearcoat");
  layers.coat_alpha = ggx_alpha(settings.clearcoat_roughness, "the material's clearcoat_roughness");
  const double amplitude = std::sqrt(0.08 * fraction(settings.specular, "the material's specular"));
  layers.index = (1 + amplitude) / (1 - amplitude);

  layers.coat = make_cosine_table(layers.coat_alpha, [&layers](double cosine) {
    if (layers.clearcoat == 0) return 0.0;
    return layers.clearcoat *
           visible_mean(layers.coat_alpha, cosine, [&](const Eigen::Vector3d& wo, const Eigen::Vector3d& m) {
             const Eigen::Vector3d wi = mirrored(wo, m);
             if (wi.z() <= 0) return 0.0;
             return fresnel_dielectric(std::min(1.0, wo.dot(m)), coat_index) *
                    ggx_shadowing(layers.coat_alpha, wo.z(), wi.z());
           });
  });
  const double index = layers.index;
  layers.missing_dielectric =
      missing_table(layers, [index](double cosine) { return fresnel_dielectric(cosine, index); });
  layers.missing_metal = missing_table(layers, [](double) { return 1.0; });
  return layers;
}

void evaluate(const PrincipledScattering& layers, const BandsIn& reflectance, const Eigen::Vector3d& wi,
              const Eigen::Vector3d& wo, BandsOut f) {
  const double cosine = std::min(1.0, wo.dot((wi + wo).normalized()));
  const double base = ggx_reflection(layers.alpha, wi, wo) * through_coat(layers, wo.z(), wi.z());
  const auto fill_of = [&](const CosineTable& missing) {
    return fill(missing.at(wo.z()), missing.at(wi.z()), missing.mean());
  };
  const double diffuse = (1 - layers.metallic) * fill_of(layers.missing_dielectric);
  const double several = layers.metallic * fill_of(layers.missing_metal);
  double uncolored = (1 - layers.metallic) * fresnel_dielectric(cosine, layers.index) * base;
  if (layers.clearcoat > 0)
    uncolored += layers.clearcoat * fresnel_dielectric(cosine, coat_index) * ggx_reflection(layers.coat_alpha, wi, wo);
  if (layers.metallic == 0) {
    f = uncolored + diffuse * reflectance;
    return;
  }
  for (Eigen::Index band = 0; band < f.size(); ++band)
    f[band] = uncolored + diffuse * reflectance[band] +
              layers.metallic * base * fresnel_schlick(cosine, reflectance[band]) +
              several * fill_color(mean_schlick(reflectance[band]), layers.missing_metal.mean());
}

double pdf(const PrincipledScattering& layers, const BandsIn& reflectance, const Eigen::Vector3d& wi,
           const Eigen::Vector3d& wo) {
  const LobeShares shares = lobe_shares(layers, reflectance, wo.z());
  double sum = shares.base * ggx_reflection_pdf(layers.alpha, wi, wo) +
               shares.dielectric_fill * layers.missing_dielectric.pdf(wi.z()) +
               shares.metal_fill * layers.missing_metal.pdf(wi.z());
  if (shares.coat > 0) sum += shares.coat * ggx_reflection_pdf(layers.coat_alpha, wi, wo);
  return sum;
}

Eigen::Vector3d sample(const PrincipledScattering& layers, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                       const Eigen::Vector3d& u) {
  const LobeShares shares = lobe_shares(layers, reflectance, wo.z());
  const Eigen::Vector2d place = u.tail<2>();
  double lobe = u.x();
  if (lobe < shares.coat) return mirrored(wo, ggx_sample_visible(layers.coat_alpha, wo, place));
  lobe -= shares.coat;
  if (lobe < shares.dielectric_fill) return layers.missing_dielectric.sample(place);
  lobe -= shares.dielectric_fill;
  if (lobe < shares.metal_fill) return layers.missing_metal.sample(place);
  return mirrored(wo, ggx_sample_visible(layers.alpha, wo, place));
}

}  // namespace tensorray
