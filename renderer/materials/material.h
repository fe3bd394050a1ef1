#pragma once
/// @file renderer/materials/material.h
/// How a surface scatters light. The frame, f, and what bands are: renderer/materials/scattering.h.

#include <optional>
#include <variant>

#include "renderer/materials/principled.h"
#include "renderer/materials/rough_conductor.h"
#include "renderer/materials/rough_dielectric.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// Lambert's: f = reflectance / π.
struct Diffuse {};

using MaterialSettings = std::variant<Diffuse, RoughConductor, RoughDielectric, Principled>;

/// Made by `make_material`; immutable, and shared by threads.
///
/// Every material is reciprocal and conserves energy: of light from any direction, at most all of it is scattered, and
/// all of it (to 2e-3) if the reflectance is 1 and the metal's n is 0. Opaque ones are the same from both sides.
struct Material {
  std::variant<Diffuse, ConductorScattering, DielectricScattering, PrincipledScattering> scattering;
  BandValues reflectance;  ///< Where the surface has no colours of its own: one for each band, 0 to 1.
};

/// Takes 10 to 30 ms (integrals over the facets).
/// @param reflectance  One for each band. Metals: a factor of Fresnel's reflectance. Glass: a factor of everything.
///                     1 for both normally.
/// @throw std::invalid_argument if a setting, or a reflectance, is out of range, or a metal has other bands.
Material make_material(const MaterialSettings& settings, const BandValues& reflectance);

/// f(wi, wo) in every band; no cosine. 0 if a direction is in the surface (z = 0), and on the far side of opaque ones.
/// @param reflectance  That of the point, 0 to 1 in each band: `material.reflectance`, or what the surface's colours
///                     (vertices, textures) give there.
/// @param f            One for each band; overwritten.
void evaluate(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wi,
              const Eigen::Vector3d& wo, BandsOut f);

/// The density, for each steradian, with which `sample` gives wi; the same for all bands. It integrates to 1 less what
/// `sample` gives up.
double pdf(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wi, const Eigen::Vector3d& wo);

struct ScatteringSample {
  Eigen::Vector3d wi;
  double pdf = 0;  ///< > 0
  /// Of the weight, the factor that is due to the n² law: (n(wo) / n(wi))² where light is refracted, else 1. It is
  /// undone where the path leaves the glass, so Russian roulette must not look at it.
  double refraction = 1;
};

/// Chooses where light comes from. @param u in [0, 1)³
/// @param weight  f(wi, wo) |cos wi| / pdf for each band, overwritten. Without the factor `refraction` it is mostly
///                about the reflectance; rarely up to 10 (rough plastic, mirrored at a grazing facet), and 30 in rough
///                glass with an index near 1.
/// @return nothing if the path ends here: the weight is then 0.
std::optional<ScatteringSample> sample(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                                       const Eigen::Vector3d& u, BandsOut weight);

}  // namespace tensorray
