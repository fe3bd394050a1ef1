#pragma once
/// @file renderer/materials/rough_conductor.h
/// Metals by their complex index of refraction, with a rough surface.

#include <string>
#include <vector>

#include "renderer/materials/microfacet.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// n + ik for each band. n = 0, k = 1 is a perfect mirror.
struct ConductorIndex {
  BandValues n;  ///< >= 0
  BandValues k;  ///< >= 0
};

/// Gold, silver and copper are of Johnson and Christy 1972 ("Optical constants of the noble metals", 342.5 to 892 nm),
/// aluminium of Rakić 1995 ("Algorithm for the determination of intrinsic optical constants of metal films", 326 to
/// 886 nm): the published values, linear between them; beyond them, the last value.
/// @param wavelengths  nm, one for each band.
/// @throw std::invalid_argument if the name is unknown; the message lists the known ones.
ConductorIndex metal_index(const std::string& name, const std::vector<double>& wavelengths);

struct RoughConductor {
  double roughness = 0.2;  ///< 0 to 1; below min_roughness: min_roughness.
  ConductorIndex index;    ///< For the bands of the film.
};

/// A metal ready to scatter. Of one bounce the masking loses light; what several bounces would have given back is added
/// as a reciprocal lobe, after Kulla and Conty 2017: n = 0 loses nothing, to 2e-3.
struct ConductorScattering {
  double alpha = 1;
  ConductorIndex index;
  BandValues mean_fresnel;  ///< Under uniform light.
  CosineTable missing;      ///< What perfect mirrors lose.
};

/// @throw std::invalid_argument if the roughness is out of range, or n and k differ in size or are not finite and >= 0.
ConductorScattering prepare(const RoughConductor& settings);

/// f for wi and wo with z > 0. @param reflectance Multiplies Fresnel's, at every bounce.
void evaluate(const ConductorScattering& metal, const BandsIn& reflectance, const Eigen::Vector3d& wi,
              const Eigen::Vector3d& wo, BandsOut f);

/// Of the directions that `sample` gives, those below the surface have no density: it integrates to less than 1.
double pdf(const ConductorScattering& metal, const BandsIn& reflectance, const Eigen::Vector3d& wi,
           const Eigen::Vector3d& wo);

/// A direction wi; it may lie below the surface, where nothing is reflected. @param u in [0, 1)³
Eigen::Vector3d sample(const ConductorScattering& metal, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                       const Eigen::Vector3d& u);

}  // namespace tensorray
