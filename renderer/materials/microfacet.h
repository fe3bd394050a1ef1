#pragma once
/// Rough surfaces as many small mirrors (facets): the isotropic GGX distribution of Trowbridge and Reitz with Smith's
/// height-correlated masking (Walter et al. 2007; Heitz 2014), and Fresnel's reflectances. Also tables over the angle,
/// with which models return the light that more than one bounce between the facets would scatter.
///
/// The frame is as in renderer/materials/scattering.h; wi and wo have z >= 0, not both 0. `alpha` is GGX's width.

#include <algorithm>
#include <array>
#include <functional>

#include <Eigen/Core>

namespace tensorray {

/// Lower roughness is replaced by this (alpha 0.0004: a highlight of a twentieth of a degree). So mirrors need no
/// second code path, and next-event estimation also finds light sources in them.
constexpr double min_roughness = 0.02;

/// @param roughness  The user's value, perceptually linear: alpha is its square.
/// @throw std::invalid_argument naming `parameter` unless the roughness is 0 to 1.
double ggx_alpha(double roughness, const char* parameter);

/// Samples a normal of the facets visible from wo, with the density ggx_visible_pdf (Heitz 2018).
/// @param u  In [0, 1)².
Eigen::Vector3d ggx_sample_visible(double alpha, const Eigen::Vector3d& wo, const Eigen::Vector2d& u);
double ggx_visible_pdf(double alpha, const Eigen::Vector3d& wo, const Eigen::Vector3d& m);

/// The fraction of a facet, visible from one direction, that is also visible from another one: G2 / G1(wo), <= 1.
double ggx_shadowing(double alpha, double cosine_o, double cosine_i);

/// Single bounces between two directions. Both are finite for cosines > 0, and f · cosine_i / pdf is ggx_shadowing.
struct GgxReflection {
  double f = 0;    ///< Of a surface of perfect mirrors.
  double pdf = 0;  ///< Of directions wi that result from reflecting wo at ggx_sample_visible.
};
GgxReflection ggx_reflection(double alpha, const Eigen::Vector3d& wi, const Eigen::Vector3d& wo);

/// The cosine between wo, or wi, and the normal of the facets that mirror one to the other.
inline double facet_cosine(const Eigen::Vector3d& wi, const Eigen::Vector3d& wo) {
  return std::min(1.0, (wi + wo).norm() / 2);
}

/// `w` mirrored at a facet; `w` and the result point away from the facet.
inline Eigen::Vector3d mirrored(const Eigen::Vector3d& w, const Eigen::Vector3d& m) { return 2 * w.dot(m) * m - w; }

/// Fresnel's reflectance for unpolarised light.
/// @param cosine  In [0, 1].
/// @param index   Index of the far side relative to the near side.
double fresnel_dielectric(double cosine, double index);
double fresnel_conductor(double cosine, double n, double k);
/// Schlick's approximation from the reflectance at normal incidence.
double fresnel_schlick(double cosine, double normal_reflectance);

/// ∫ fresnel(cosine) d(cosine²) over [0, 1]: the reflectance under uniform light.
double hemispherical_mean(const std::function<double(double cosine)>& fresnel);

/// The mean of `weight(wo, m)` over the facets m visible from a wo with this cosine; accurate to about 1e-4.
double visible_mean(double alpha, double cosine,
                    const std::function<double(const Eigen::Vector3d& wo, const Eigen::Vector3d& m)>& weight);

/// A function in [0, 1] of a direction's cosine, linear between knots that are dense near the horizon. It is also a
/// distribution of directions: the function times the cosine, normalised.
struct CosineTable {
  static constexpr int segments = 96;
  double horizon = 1;                             ///< The cosine below which a quarter of the knots lie.
  std::array<double, segments + 1> values{};      ///< At the knots.
  std::array<double, segments> means{};           ///< Mean over each segment, weighted by cosine².
  std::array<double, segments + 1> cumulative{};  ///< Integral over cosine² from 0; the last value is the mean.

  double mean() const { return cumulative[segments]; }
  double at(double cosine) const;
  double pdf(double cosine) const;                         ///< Per steradian; 0 if the function is 0.
  Eigen::Vector3d sample(const Eigen::Vector2d& u) const;  ///< Unit, z >= 0.
};

/// Makes a table; clamps values to [0, 1].
/// @param alpha  Of the smoothest layer: masking changes where the cosine is about alpha.
CosineTable make_cosine_table(double alpha, const std::function<double(double cosine)>& function);

/// The lobe that returns missing light (Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks"): f =
/// missing(wo) missing(wi) / (π mean). It is reciprocal and scatters the fraction missing(wo) of uniform light.
double fill(double missing_o, double missing_i, double mean);

/// The colour of `fill` for mirrors with the reflectance `mean_fresnel` under uniform light that lose the fraction
/// `missing` of it: the geometric series of bounces. 1 for perfect mirrors.
double fill_color(double mean_fresnel, double missing);

}  // namespace tensorray
