#pragma once
/// The method "photon_distribution": the bent light on the plate and inside the volume.

#include <memory>
#include <optional>

#include "renderer/density/density.h"
#include "scenes/description/method.h"

namespace tensorray {

enum class PhotonDensityKind {
  mesh,                 ///< Exact: the light between neighbouring rays, spread over the area between their landings.
  gaussian,             ///< Zheng and Pang 2003, Eq. 10: each photon is a Gaussian on the plate.
  histogram,            ///< Each photon counts in its pixel.
  photon_differential,  ///< Each photon covers the area that the light about it covers.
};

/// `integrator.density`.
struct PhotonDensity {
  PhotonDensityKind kind = PhotonDensityKind::mesh;
  double tolerance = 0.5;
  std::optional<double> error;  ///< Wanted relative error of the picture, instead of a tolerance.
  double tau = 6;
  double footprint = 1;
};

struct PhotonDescription {
  PhotonDensity density;
  std::optional<bool> side_light;  ///< Whether light that leaves the volume by its side faces falls on the plate.
};

inline Words words(PhotonDensityKind) { return {"mesh", "gaussian", "histogram", "photon_differential"}; }

/// The estimator for photons. `mesh` needs no photons; photons for other outputs are then only counted.
inline DensitySettings estimator_of(const PhotonDensity& density) {
  DensitySettings settings{DensityKind::histogram, density.tau, density.footprint};
  if (density.kind == PhotonDensityKind::gaussian) settings.kind = DensityKind::gaussian;
  if (density.kind == PhotonDensityKind::photon_differential) settings.kind = DensityKind::photon_differential;
  return settings;
}

inline void describe(PhotonDensity& density, KeyVisitor& visit) {
  visit("kind", density.kind, "method that computes irradiance from rays", knob());
  visit("tolerance", density.tolerance, "mesh: wanted error of landings, in pixels",
        between(0.001, 100).as_knob(0.05, 5));
  visit("error", density.error, "mesh: refine until the picture's relative error is below this, instead of `tolerance`",
        between(1e-5, 1));
  visit("tau", density.tau, "gaussian: standard deviation, in pixels", between(0.3, 1000).as_knob(0.3, 50));
  visit("footprint", density.footprint, "photon_differential: standard deviation, in spacings of the photons",
        between(0.01, 100).as_knob(0.1, 10));
}

inline void describe(PhotonDescription& photons, KeyVisitor& visit) {
  visit.section("density", photons.density, "photon_distribution: estimation of irradiance on the plate");
  visit("side_light", photons.side_light,
        "photon_distribution: whether light that leaves the volume by its side faces falls on the plate; default: with "
        "the beam `volume`, an aperture, or a field that ends at the surface of a body");
}

std::shared_ptr<Method> photon_distribution_method();

}  // namespace tensorray
