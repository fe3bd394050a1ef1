#pragma once
/// @file integrators/scene/sunlight.h
/// The lights of the method "scene", and the light that suns and points throw through the field on its objects.

#include <functional>
#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "integrators/scene/objects.h"
#include "integrators/scene/photons.h"
#include "integrators/scene/scene_method_description.h"
#include "renderer/light_maps/irradiance_map.h"

namespace tensorray {

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
