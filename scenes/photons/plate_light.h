#pragma once
/// @file scenes/photons/plate_light.h
/// The light of a scene on its plate and inside its volume.

#include <string>
#include <vector>

#include "base/process/progress.h"
#include "integrators/flow/flow_map.h"
#include "renderer/film/film.h"
#include "renderer/film/plate_photon.h"
#include "renderer/images/image.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "volumes/grids/scalar_grid.h"

namespace tensorray {

struct PlateLight {
  Image linear;                      ///< R, G, B in the working space; 1 is the undisturbed light.
  FlowMap map;                       ///< The map that `mesh` has drawn; empty for other estimators.
  Film irradiance;                   ///< A plane for each band, if the scene writes spectral pictures.
  std::vector<PlatePhoton> photons;  ///< If the scene writes photons.
  std::vector<ScalarGrid> fluence;   ///< If the scene writes the fluence; see PhotonDistribution.
  Statistics statistics;             ///< Without `seconds_color`.
  std::vector<std::string> warnings;
};

/// Traces the light with the density estimator of the method photon_distribution. `mesh` draws the flow map of the
/// beam, with the team of the job; photons and fluence, if the scene asks for them, are then traced as for the other
/// estimators, by process 0. @throw Cancelled; as Team::exchange.
PlateLight light_on_plate(const Scene& scene, const Progress& progress, RenderJob* job = nullptr);

}  // namespace tensorray
