#pragma once
/// @file renderer/materials/principled.h
/// One material for most things, with the parameters that artists know (Burley 2012, "Physically Based Shading at
/// Disney"): from plastic to metal, with a coat of lacquer if wanted.

#include "renderer/materials/microfacet.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// All in 0 to 1. The base colour is the reflectance.
struct Principled {
  double metallic = 0;     ///< 0: a dielectric over a diffuse ground; 1: a metal of the base colour.
  double roughness = 0.5;  ///< Below min_roughness: min_roughness.
  double specular = 0.5;   ///< Of the dielectric: 0 no reflection, 0.5 index 1.5 (4 %), 1 index 1.8 (8 %).
  double clearcoat = 0;    ///< How much of the surface is lacquered (index 1.5).
  double clearcoat_roughness = 0.1;
};

/// The material ready to scatter: the same from both sides. Reciprocal; energy is conserved layer by layer: what the
/// coat reflects, the base does not get, and what both do not reflect in one bounce is returned by a lobe in the base
/// colour, which is the diffuse ground of the dielectric, and the several bounces of the metal. A white base (1 in all
/// bands) returns all light, to 2e-3, whatever the parameters.
struct PrincipledScattering {
  double metallic = 0;
  double alpha = 1;
  double index = 1.5;  ///< Of the dielectric.
  double clearcoat = 0;
  double coat_alpha = 1;
  CosineTable coat;                ///< What the coat reflects.
  CosineTable missing_dielectric;  ///< What coat and dielectric do not reflect in one bounce,
  CosineTable missing_metal;       ///< and what coat and perfect metal do not.
};

/// @throw std::invalid_argument naming the setting that is out of range.
PrincipledScattering prepare(const Principled& settings);

/// As for conductors: wi and wo with z > 0, u in [0, 1)³; `sample` may give a direction below the surface.
void evaluate(const PrincipledScattering& layers, const BandsIn& reflectance, const Eigen::Vector3d& wi,
              const Eigen::Vector3d& wo, BandsOut f);
double pdf(const PrincipledScattering& layers, const BandsIn& reflectance, const Eigen::Vector3d& wi,
           const Eigen::Vector3d& wo);
Eigen::Vector3d sample(const PrincipledScattering& layers, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                       const Eigen::Vector3d& u);

}  // namespace tensorray
