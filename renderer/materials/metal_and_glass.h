#pragma once
/// Rough surfaces of metals, with a complex index of refraction, and of glass and similar materials.

#include <string>
#include <vector>

#include "renderer/materials/microfacet.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// n + ik for each band. n = 0 with k = 1 is a perfect mirror.
struct ConductorIndex {
  BandValues n;  ///< >= 0
  BandValues k;  ///< >= 0
};

/// Sources: Johnson and Christy 1972 for gold, silver and copper ("Optical constants of the noble metals", 342.5 to 892
/// nm), Rakić 1995 for aluminium ("Algorithm for the determination of intrinsic optical constants of metal films", 326
/// to 886 nm). The published values are interpolated linearly; beyond them, the last value applies.
/// @param wavelengths  nm, one for each band.
/// @throw std::invalid_argument if the name is unknown; the message lists the known ones.
ConductorIndex metal_index(const std::string& name, const std::vector<double>& wavelengths);

struct RoughConductor {
  double roughness = 0.2;  ///< 0 to 1; values below min_roughness count as min_roughness.
  ConductorIndex index;    ///< For the bands of the film.
};

/// A prepared metal. Masking loses light of single bounces. A reciprocal lobe after Kulla and Conty 2017 adds the light
/// of multiple bounces: n = 0 loses nothing, to 2e-3.
struct ConductorScattering {
  double alpha = 1;
  ConductorIndex index;
  BandValues mean_fresnel;  ///< Under uniform light.
  CosineTable missing;      ///< Fraction that perfect mirrors lose.
};

/// @throw std::invalid_argument if the roughness is out of range, or n and k differ in size or are not finite and >= 0.
ConductorScattering prepare(const RoughConductor& settings);

/// Sets f for wi and wo with z > 0, in as many bands as it has.
/// @param reflectance  A factor of Fresnel's reflectance at every bounce.
/// @return the density of `sample`; 0 below the surface, where it may give directions: its integral is below 1.
double evaluate(const ConductorScattering& metal, const BandsIn& reflectance, const Eigen::Vector3d& wi,
                const Eigen::Vector3d& wo, BandsOut f, Eigen::Index first_band = 0);

/// Samples a direction wi. It may be below the surface, where nothing is reflected.
/// @param u  In [0, 1)².
Eigen::Vector3d sample(const ConductorScattering& metal, const Eigen::Vector3d& wo, const Eigen::Vector2d& u);

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
