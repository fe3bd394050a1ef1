#pragma once
/// @file integrators/photon_distribution/mesh_light.h
/// The light of a scene on its plate with the density `mesh`: drawn from the flow map of the beam.

#include <functional>

#include "base/process/progress.h"
#include "integrators/photon_distribution/plate_light.h"

namespace tensorray {

/// Draws the light, with the ranks of the job. Its shards and checkpoints have the landings of its flow maps' vertices
/// (FlowSettings::is_kept): of a shard, the result is empty. With a bound of the error, a shard refines until the error
/// of its own part is below it; what more the whole picture needs is traced where the shards are merged.
/// @param job   Null: alone, and nothing is kept. @param show  Gets the light so far when the job wants a picture.
/// @throw Cancelled; as Ranks::all_gather.
PlateLight mesh_light(const Scene& scene, const Progress& progress, Job* job, const ShowLight& show);

}  // namespace tensorray
