#pragma once
/// @file integrators/photon_distribution/plate_light.h
/// The light of a scene on its plate and inside its volume.

#include <functional>
#include <string>
#include <vector>

#include "base/process/progress.h"
#include "renderer/film/film.h"
#include "renderer/images/image.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tracing/flow/flow_map.h"
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

/// Adds the time, the steps and the samples of other work.
void add_cost(const Statistics& more, Statistics& statistics);

/// Gets light that is not complete yet.
using ShowLight = std::function<void(PlateLight)>;

/// Traces the light with the density estimator of the method photon_distribution, with the ranks of the job. `mesh`
/// draws the flow map of the beam; photons and fluence, if the scene asks for them, are then traced as for the other
/// estimators. Of a shard, the result is not complete: what it has traced is in the job.
/// @param show  Gets the light so far when the job wants a picture; may be empty.
/// @throw Cancelled; as Ranks::all_gather.
PlateLight light_on_plate(const Scene& scene, const Progress& progress, Job* job = nullptr, const ShowLight& show = {});

}  // namespace tensorray
