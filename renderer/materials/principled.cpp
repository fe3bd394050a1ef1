#include "renderer/materials/principled.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "base/constants.h"
#include "renderer/sampling/sampling.h"

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

PrincipledView viewed(const PrincipledScattering& layers, const BandsIn& reflectance, double cosine_o) {
  const double metallic = layers.metallic, typical = reflectance.mean();
  PrincipledView view;
  if (layers.clearcoat > 0) view.coat = view.coat_reflects = layers.coat.at(cosine_o);
  if (metallic < 1) {
    view.missing_dielectric = layers.missing_dielectric.at(cosine_o);
    view.base = (1 - metallic) * (1 - view.coat - view.missing_dielectric);
    view.dielectric_fill = (1 - metallic) * typical * view.missing_dielectric;
  }
  if (metallic > 0) {
    view.missing_metal = layers.missing_metal.at(cosine_o);
    view.base += metallic * (1 - view.coat - view.missing_metal) * fresnel_schlick(cosine_o, typical);
    view.metal_fill = metallic * view.missing_metal * fill_color(mean_schlick(typical), layers.missing_metal.mean());
  }
  view.base = std::max(1e-3, view.base);
  const double scale = 1 / (view.coat + view.base + view.dielectric_fill + view.metal_fill);
  for (double* share : {&view.coat, &view.base, &view.dielectric_fill, &view.metal_fill}) *share *= scale;
  return view;
}

double evaluate(const PrincipledScattering& layers, const PrincipledView& view, const BandsIn& reflectance,
                const Eigen::Vector3d& wi, const Eigen::Vector3d& wo, BandsOut f) {
  const double cosine = facet_cosine(wi, wo), metallic = layers.metallic;
  GgxReflection base = ggx_reflection(layers.alpha, wi, wo);
  double density = view.base * base.pdf, uncolored = 0;
  if (layers.clearcoat > 0) {
    const GgxReflection coat = ggx_reflection(layers.coat_alpha, wi, wo);
    density += view.coat * coat.pdf;
    uncolored = layers.clearcoat * fresnel_dielectric(cosine, coat_index) * coat.f;
    base.f *= 1 - std::max(view.coat_reflects, layers.coat.at(wi.z()));
  }
  const auto fill_of = [&](double missing_o, const CosineTable& missing) {
    return fill(missing_o, missing.at(wi.z()), missing.mean());
  };
  double diffuse = 0;
  if (metallic < 1) {
    density += view.dielectric_fill * wi.z() / pi;
    uncolored += (1 - metallic) * fresnel_dielectric(cosine, layers.index) * base.f;
    diffuse = (1 - metallic) * fill_of(view.missing_dielectric, layers.missing_dielectric);
  }
  f = uncolored + diffuse * reflectance.head(f.size());
  if (metallic == 0) return density;
  const double several = metallic * fill_of(view.missing_metal, layers.missing_metal),
               missing = layers.missing_metal.mean();
  for (Eigen::Index band = 0; band < f.size(); ++band)
    f[band] += metallic * base.f * fresnel_schlick(cosine, reflectance[band]) +
               several * fill_color(mean_schlick(reflectance[band]), missing);
  return density + view.metal_fill * wi.z() / pi;
}

Eigen::Vector3d sample(const PrincipledScattering& layers, const PrincipledView& view, const Eigen::Vector3d& wo,
                       const Eigen::Vector2d& u) {
  Eigen::Vector2d place = u;
  double rest = 1;
  const auto choose_lobe = [&](double share) {
    const bool chosen = choose(share / rest, place.x());
    rest -= share;
    return chosen;
  };
  if (choose_lobe(view.dielectric_fill)) return square_to_cosine_hemisphere(place);
  if (choose_lobe(view.coat)) return mirrored(wo, ggx_sample_visible(layers.coat_alpha, wo, place));
  if (choose_lobe(view.metal_fill)) return square_to_cosine_hemisphere(place);
  return mirrored(wo, ggx_sample_visible(layers.alpha, wo, place));
}

}  // namespace tensorray
