#pragma once
/// @file integrators/scene/field_light.h
/// The lights of the method "scene", and the light that they throw through the field on its objects. Each pair of a
/// light and an object has either photons (photons.cpp) or a flow map (sunlight.cpp).

#include <cstdint>
#include <functional>
#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "integrators/scene/objects.h"
#include "integrators/scene/scene_method.h"
#include "renderer/light_maps/irradiance_map.h"
#include "renderer/light_maps/photon_tracer.h"

namespace tensorray {

/// For each light, for each object: whether photons are its light through the field. A light whose `caustic` is "auto"
/// has photons where no flow map can be right, since it has the light of one side of a plate: on plates within the
/// volume that it meets before the middle, and on plates along the light whose plane divides the volume. Points within
/// the volume have no beam through it, and so always photons. Where radiance is conserved, all objects have photons,
/// since a flow map keeps power. An area light has photons beside other techniques; with "auto" if it is small.
using PhotonPairs = std::vector<std::vector<bool>>;
PhotonPairs photon_pairs(const LitObjects& lit, const SceneMethodDescription& settings);

/// @param passes  Of photons.
/// @throw Cancelled; as Ranks::all_gather.
PhotonMaps trace_object_photons(const LitObjects& lit, const PhotonPairs& pairs, const BendingRegion& region,
                                const PhotonsDescription& description, int passes, const Progress& progress);

/// The scene's lights; if it has none, a sky and a sun. The sun shines along the scene's `light` if that falls.
std::vector<Light> scene_lights(const Scene& scene, const ShownLights& shown, const Camera& camera);

/// The flexibility of light of a wavelength, nm. In RGB mode it is interpolated linearly, and continued, between 650,
/// 550 and 450 nm, to which the paper gives its three flexibilities.
std::function<double(double)> flexibility_of(const BendingDescription& bending);

/// The light of directional lights and points that lands on the objects through the field, by flow maps: of all pairs
/// but those that have photons. @throw SceneError if a light is where it can have no map; Cancelled; as
/// Ranks::all_gather.
std::vector<IrradianceMap> land_light(const LitObjects& lit, const PhotonPairs& photons, const ShownLight& shown,
                                      const CausticDescription& caustic, const Progress& progress);

}  // namespace tensorray
