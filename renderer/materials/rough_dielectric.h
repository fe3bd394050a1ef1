#pragma once
/// @file renderer/materials/rough_dielectric.h
/// Glass and the like: a rough surface that reflects and refracts.

#include "renderer/materials/microfacet.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

struct RoughDielectric {
  double roughness = 0.1;  ///< 0 to 1; below min_roughness: min_roughness.
  double index = 1.5;      ///< Of the inside (z < 0), relative to the outside: 0.2 to 5, and 0.01 from 1 at least.
};

/// Glass ready to scatter (Walter et al. 2007), on both sides. Radiance obeys the n² law: f(wi, wo) / n(wo)² =
/// f(wo, wi) / n(wi)². Of uniform light (radiance in proportion to n²) nothing is lost, to 2e-3 (1e-2 near the
/// horizon if the index is within 0.1 of 1): what single bounces lose is returned by reciprocal lobes, reflected and
/// refracted.
struct DielectricScattering {
  double alpha = 1;
  double index = 1.5;
  CosineTable missing_outside;  ///< What single bounces of light from there lose, reflected and refracted together.
  CosineTable missing_inside;
  double refracted = 0;  ///< The strength of the lobes that refract; see prepare() in the source.
};

/// @throw std::invalid_argument if a setting is out of range.
DielectricScattering prepare(const RoughDielectric& settings);

/// Arguments as for conductors, but wi and wo may have any z but 0.
/// @param reflectance  Multiplies all that is scattered.
void evaluate(const DielectricScattering& glass, const BandsIn& reflectance, const Eigen::Vector3d& wi,
              const Eigen::Vector3d& wo, BandsOut f);
double pdf(const DielectricScattering& glass, const BandsIn& reflectance, const Eigen::Vector3d& wi,
           const Eigen::Vector3d& wo);
/// It may give a zero vector, or a direction that `evaluate` says is dark: that light is lost between the facets.
Eigen::Vector3d sample(const DielectricScattering& glass, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                       const Eigen::Vector3d& u);

}  // namespace tensorray
