#pragma once
/// @file renderer/materials/rough_dielectric.h
/// Glass and similar materials: a rough surface that reflects and refracts.

#include "renderer/materials/microfacet.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

struct RoughDielectric {
  double roughness = 0.1;  ///< 0 to 1; values below min_roughness count as min_roughness.
  double index = 1.5;      ///< Index of the inside (z < 0) relative to the outside: 0.2 to 5, at least 0.01 from 1.
};

/// A prepared glass (Walter et al. 2007), for both sides. Radiance obeys the n² law: f(wi, wo) / n(wo)² = f(wo, wi) /
/// n(wi)². No uniform light (radiance in proportion to n²) is lost, to 2e-3 (1e-2 near the horizon if the index is
/// within 0.1 of 1): reciprocal lobes, reflected and refracted, return what single bounces lose.
struct DielectricScattering {
  double alpha = 1;
  double index = 1.5;
  CosineTable missing_outside;  ///< Fraction of light from this side that single bounces (reflected or refracted) lose.
  CosineTable missing_inside;
  double refracted = 0;  ///< Strength of the refracting lobes; see prepare() in the source.
};

/// @throw std::invalid_argument if a setting is out of range.
DielectricScattering prepare(const RoughDielectric& settings);

/// Arguments are as for conductors, but wi and wo may have any z except 0.
/// @param reflectance  A factor of all scattered light.
double evaluate(const DielectricScattering& glass, const BandsIn& reflectance, const Eigen::Vector3d& wi,
                const Eigen::Vector3d& wo, BandsOut f);
/// @param u  In [0, 1)³; z chooses between reflection and refraction.
/// May give a zero vector, or a direction for which `evaluate` gives 0: this light is lost between the facets.
Eigen::Vector3d sample(const DielectricScattering& glass, const Eigen::Vector3d& wo, const Eigen::Vector3d& u);

}  // namespace tensorray
