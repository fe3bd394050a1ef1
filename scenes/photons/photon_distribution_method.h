#pragma once
/// @file scenes/photons/photon_distribution_method.h
/// The method "photon_distribution": the bent light on the plate and inside the volume.

#include <array>
#include <memory>

#include "integrators/photons/photon_distribution.h"
#include "renderer/film/density.h"
#include "renderer/images/image.h"
#include "scenes/description/method.h"

namespace tensorray {

struct PhotonDescription {
  DensitySettings density;
};

inline auto choices(DensityKind) {
  using C = Choice<DensityKind>;
  return std::array{C{"gaussian", DensityKind::gaussian}, C{"histogram", DensityKind::histogram}};
}

template <class Visitor>
void describe(DensitySettings& density, Visitor& visit) {
  visit("kind", density.kind, "method that estimates irradiance from photons");
  visit("tau", density.tau, "standard deviation of the gaussian, in pixels", between(0.3, 1000));
}

template <class Visitor>
void describe(PhotonDescription& photons, Visitor& visit) {
  visit.section("density", photons.density, "photon_distribution: estimation of density on the plate");
}

std::shared_ptr<Method> photon_distribution_method();

/// Traces the light of the scene to its plate. The film has a plane for each band; if no output needs the bands, it has
/// planes for red, green and blue. @throw Cancelled.
PhotonDistribution distribute_photons(const Scene& scene, const Progress& progress);

/// The picture of the light that distribute_photons collects.
Image light_image(const Scene& scene, const Film& irradiance);

}  // namespace tensorray
