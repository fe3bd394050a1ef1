#pragma once
/// A material for most purposes, with parameters that artists are used to (Burley 2012, "Physically Based Shading at
/// Disney"): plastic to metal, optionally with a coat of lacquer.

#include "renderer/materials/microfacet.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// All values are in 0 to 1. The reflectance is the base colour.
struct Principled {
  double metallic = 0;     ///< 0: a dielectric over a diffuse base; 1: a metal with the base colour.
  double roughness = 0.5;  ///< Values below min_roughness count as min_roughness.
  double specular = 0.5;   ///< Of the dielectric: 0: no reflection, 0.5: index 1.5 (4 %), 1: index 1.8 (8 %).
  double clearcoat = 0;    ///< Fraction of the surface that is lacquered (index 1.5).
  double clearcoat_roughness = 0.1;
};

/// The prepared material, the same from both sides. It is reciprocal and conserves energy layer by layer: the base does
/// not receive what the coat reflects. A lobe in the base colour returns what both do not reflect in one bounce; it is
/// the diffuse base of the dielectric and the multiple bounces of the metal. A white base returns all light, to 2e-3.
struct PrincipledScattering {
  double metallic = 0;
  double alpha = 1;
  double index = 1.5;  ///< Of the dielectric.
  double clearcoat = 0;
  double coat_alpha = 1;
  CosineTable coat;                ///< Fraction that the coat reflects.
  CosineTable missing_dielectric;  ///< Fraction that coat and dielectric do not reflect in one bounce.
  CosineTable missing_metal;       ///< Fraction that coat and perfect metal do not reflect in one bounce.
};

/// @throw std::invalid_argument naming the setting that is out of range.
PrincipledScattering prepare(const Principled& settings);

/// What all directions of light share at a point: it depends on the viewer and on the reflectance.
struct PrincipledView {
  /// Sampling probability of each lobe, in proportion to what it scatters in the mean of the bands.
  double coat = 0, base = 0, dielectric_fill = 0, metal_fill = 0;
  double coat_reflects = 0, missing_dielectric = 0, missing_metal = 0;  ///< The tables at the viewer's cosine.
};

/// @param cosine_o  Of wo; > 0.
PrincipledView viewed(const PrincipledScattering& layers, const BandsIn& reflectance, double cosine_o);

/// As for conductors: wi and wo with z > 0, u in [0, 1)². `sample` may give a direction below the surface.
/// @param view  That of `reflectance` and wo.
double evaluate(const PrincipledScattering& layers, const PrincipledView& view, const BandsIn& reflectance,
                const Eigen::Vector3d& wi, const Eigen::Vector3d& wo, BandsOut f);
Eigen::Vector3d sample(const PrincipledScattering& layers, const PrincipledView& view, const Eigen::Vector3d& wo,
                       const Eigen::Vector2d& u);

}  // namespace tensorray
