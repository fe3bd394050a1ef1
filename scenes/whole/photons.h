#pragma once
/// @file scenes/whole/photons.h
/// Which lights of a whole scene light which objects by photons, and these photons. Each pair of a light and an object
/// has either photons or a flow map (sunlight.h).

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "renderer/shading/photon_tracer.h"
#include "scenes/whole/objects.h"
#include "scenes/whole/whole_description.h"

namespace tensorray {

/// For each light, for each object (the surface of object i has the index i): whether photons are its light through the
/// field. A light whose `caustic` is "auto" has photons where no flow map can be right, since it has the light of one
/// side of a plate: on plates within the volume that it meets before the middle, and on plates along the light whose
/// plane divides the volume. Points within the volume have no beam through it, and so always photons. Where radiance is
/// conserved, all objects have photons, since a flow map keeps power. An area light has photons beside other
/// techniques; with "auto" if it is small.
using PhotonPairs = std::vector<std::vector<bool>>;
PhotonPairs photon_pairs(const Scene& scene, const std::vector<Light>& lights, const std::vector<SceneObject>& objects,
                         const WholeDescription& settings);

/// @param passes  Of photons.
/// @throw Cancelled.
TracedPhotons photons_of(const Scene& scene, const BendingRegion& region, const SurfaceScene& stage,
                         const std::vector<Light>& lights, const std::vector<SceneObject>& objects,
                         const PhotonPairs& pairs, const PhotonsDescription& description, int passes,
                         const Progress& progress);

}  // namespace tensorray
