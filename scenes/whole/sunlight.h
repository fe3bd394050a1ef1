#pragma once
/// @file scenes/whole/sunlight.h
/// The lights of a whole scene, and the light that suns and points throw through the field on its objects.

#include <functional>
#include <vector>

#include "base/progress.h"
#include "renderer/shading/landed_light.h"
#include "scenes/path_tracing/load_paths.h"
#include "scenes/whole/objects.h"
#include "scenes/whole/photons.h"
#include "scenes/whole/whole_description.h"

namespace tensorray {

/// The scene's lights; if it has none, a sky and a sun. The sun shines along the scene's `light` if that falls.
std::vector<Light> whole_lights(const Scene& scene, const ShownLights& shown, const Camera& camera);

/// The flexibility of light of a wavelength, nm. In RGB mode it is interpolated linearly, and continued, between 650,
/// 550 and 450 nm, to which the paper gives its three flexibilities.
std::function<double(double)> flexibility_of(const BendingDescription& bending);

/// The light of directional lights and points that lands on `objects` through the field, by flow maps: of all pairs but
/// those that have photons. @param stage  All surfaces; that of object i has the index i. @throw Cancelled.
std::vector<LandedLight> land_light(const Scene& scene, const std::vector<Light>& lights, const ShownLight& shown,
                                    const std::vector<SceneObject>& objects, const SurfaceScene& stage,
                                    const CausticDescription& caustic, const PhotonPairs& photons,
                                    const Progress& progress);

}  // namespace tensorray
