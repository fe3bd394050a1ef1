#pragma once
/// @file integrators/scene/photons.h
/// Which lights light which objects by photons, and these photons. Each pair of a light and an object
/// has either photons or a flow map (sunlight.h).

#include <cstdint>
#include <vector>

#include "base/process/progress.h"
#include "integrators/scene/objects.h"
#include "integrators/scene/scene_method_description.h"
#include "renderer/light_maps/photon_tracer.h"

namespace tensorray {

/// For each light, for each object: whether photons are its light through the
/// field. A light whose `caustic` is "auto" has photons where no flow map can be right, since it has the light of one
/// side of a plate: on plates within the volume that it meets before the middle, and on plates along the light whose
/// plane divides the volume. Points within the volume have no beam through it, and so always photons. Where radiance is
/// conserved, all objects have photons, since a flow map keeps power. An area light has photons beside other
/// techniques; with "auto" if it is small.
using PhotonPairs = std::vector<std::vector<bool>>;
PhotonPairs photon_pairs(const LitObjects& lit, const SceneMethodDescription& settings);

/// @param passes  Of photons.
/// @throw Cancelled; as Ranks::all_gather.
PhotonMaps photons_of(const LitObjects& lit, const PhotonPairs& pairs, const BendingRegion& region,
                      const PhotonsDescription& description, int passes, const Progress& progress);

}  // namespace tensorray
