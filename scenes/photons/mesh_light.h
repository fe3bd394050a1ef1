#pragma once
/// @file scenes/photons/mesh_light.h
/// The light of a scene on its plate with the density `mesh`: drawn from the flow map of the beam.

#include <functional>

#include "base/process/progress.h"
#include "scenes/photons/plate_light.h"

namespace tensorray {

/// Draws the light, with the team of the job. Its shards and checkpoints have the landings of its flow maps'
/// vertices (KeptResults): of a shard, the result is empty. With a bound of the error, a shard refines until the error
/// of its own part is below it; what more the whole picture needs is traced where the shards are merged.
/// @param job   Null: alone, and nothing is kept. @param show  Gets the light so far when the job wants a picture.
/// @param kept  As in light_on_plate. @throw Cancelled; as Team::exchange.
PlateLight mesh_light(const Scene& scene, const Progress& progress, RenderJob* job, const ShowLight& show,
                      KeptResults* kept);

}  // namespace tensorray
