#pragma once
/// How a surface scatters light. For the frame, f and bands, see renderer/materials/scattering.h.

#include <optional>
#include <variant>

#include "renderer/materials/metal_and_glass.h"
#include "renderer/materials/principled.h"
#include "renderer/materials/scattering.h"

namespace tensorray {

/// Lambert's: f = reflectance / π.
struct Diffuse {};

using MaterialSettings = std::variant<Diffuse, RoughConductor, RoughDielectric, Principled>;

/// Made by `make_material`; immutable; threads may share it.
///
/// Every material is reciprocal and conserves energy: it never scatters more light than arrives, from any direction. It
/// scatters all light (to 2e-3) if the reflectance is 1 and the metal's n is 0. Opaque ones have equal sides.
struct Material {
  std::variant<Diffuse, ConductorScattering, DielectricScattering, PrincipledScattering> scattering;
  BandValues reflectance;  ///< For surfaces without their own colours: one value for each band, 0 to 1.
};

/// Whether light may go through the surface.
bool is_glass(const Material& material);

/// Whether all light from the side of the viewer is scattered alike: f = reflectance / π.
bool is_diffuse(const Material& material);

/// The factor of the reflectance, in all bands, with which the material reflects uniform light; null: 1.
const BandValues* mean_fresnel(const Material& material);

/// Takes 10 to 30 ms (integrals over the facets).
/// @param reflectance  One value for each band. Metals: a factor of Fresnel's reflectance. Glass: a factor of all
///                     scattered light. Normally 1 for both.
/// @throw std::invalid_argument if a setting or a reflectance is out of range, or a metal has other bands.
Material make_material(const MaterialSettings& settings, const BandValues& reflectance);

/// What all directions of light share at a point that a viewer sees.
struct ViewedMaterial {
  Eigen::Vector3d wo;
  Eigen::Index first_band = 0;  ///< Of the reflectance, and of f.
  PrincipledView principled;    ///< Of that material only.
};

/// @param reflectance  Reflectance at the point, 0 to 1 in each band: `material.reflectance`, or that of the surface's
///                     colours (vertices, textures) at the point.
/// @param first_band   Of `reflectance`, which may have some of the bands only.
ViewedMaterial viewed(const Material& material, const BandsIn& reflectance, const Eigen::Vector3d& wo,
                      Eigen::Index first_band = 0);

/// Sets f(wi, wo) in every band, without a cosine. It is 0 if a direction has z = 0, and behind opaque materials.
/// @param view, reflectance  Of the point: `viewed` has made the one of the other.
/// @param f  One value for each band; overwritten.
/// @return `pdf`, which shares most of the work.
double evaluate(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance,
                const Eigen::Vector3d& wi, BandsOut f);

/// The density, per steradian, with which `sample` gives wi; the same for all bands of `reflectance`. Its integral is 1
/// minus the probability that `sample` returns nothing.
double pdf(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance, const Eigen::Vector3d& wi);

struct ScatteringSample {
  Eigen::Vector3d wi;
  double pdf = 0;  ///< > 0
  /// The factor of the weight that is due to the n² law: (n(wo) / n(wi))² for refraction, otherwise 1. It cancels where
  /// the path leaves the glass, so Russian roulette must ignore it.
  double refraction = 1;
};

/// Chooses the direction that light comes from.
/// @param u       In [0, 1)³; z matters to glass alone.
/// @param weight  f(wi, wo) |cos wi| / pdf for each band; overwritten. Without the factor `refraction` it is usually
///                close to the reflectance. Rarely, it reaches 10 (rough plastic, mirrored at a grazing facet), or 30
///                in rough glass with an index near 1.
/// @return nothing if the path ends here; the weight is then 0.
std::optional<ScatteringSample> sample(const Material& material, const ViewedMaterial& view, const BandsIn& reflectance,
                                       const Eigen::Vector3d& u, BandsOut weight);

}  // namespace tensorray
