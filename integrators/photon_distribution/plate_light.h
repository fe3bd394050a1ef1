#pragma once
/// The light of a scene on its plate and inside its volume.

#include <functional>

#include "base/process/job.h"
#include "base/process/progress.h"
#include "renderer/film/film.h"
#include "renderer/images/image.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

struct PlateLight {
  Render render;  ///< `linear` (1 is the undisturbed light); photons and fluence, if the scene writes them; statistics,
                  ///< without `seconds_color`; warnings.
  FlowMap map;    ///< The map that `mesh` has drawn; empty for other estimators.
  Film irradiance;  ///< A plane for each band, if the scene writes spectral pictures.
};

/// The light of a scene that may fall on its plate: wide enough for all of it, if the scene's light fills it.
Beam beam_on_plate(const Scene& scene);

/// Whether light that leaves the volume by its side faces counts. By default it does where the picture shows a beam or
/// a body, and not where the field just ends at its box.
bool keeps_side_light(const Scene& scene);

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

/// The light of a scene with the density `mesh`: drawn from the flow map of the beam, with the ranks of the job. Its
/// shards and checkpoints have the landings of its flow maps' vertices (FlowSettings::is_kept): of a shard, the result
/// is empty. With a bound of the error, a shard refines until that of its own part is below it.
/// @param job   Null: alone, and nothing is kept. @param show  Gets the light so far when the job wants a picture.
/// @throw Cancelled; as Ranks::all_gather.
PlateLight mesh_light(const Scene& scene, const Progress& progress, Job* job, const ShowLight& show);

/// The channels of plate_map.
std::vector<std::string> plate_map_channels();

/// How the light of the band nearest to 550 nm (in RGB mode: green) lands at the centre of each pixel. All channels are
/// 0 where no light lands. Where the map folds, they describe the sheet that is displaced least.
/// @param map   To the plate of the scene. Runs on all threads; the result does not depend on their number.
/// @param job   Whose ranks have the same map and do this together, for the root; null: alone.
Image plate_map(const FlowMap& map, const Scene& scene, const Progress& progress, Job* job = nullptr);

}  // namespace tensorray
