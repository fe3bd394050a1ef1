#pragma once
/// @file scenes/outputs/statistics_json.h
/// The statistics of a render as JSON.

#include <string>

#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// `photons` counts rays; one position emits one ray for each wavelength. `power` is the power of these rays, in the
/// unit of the light's irradiance times area. Both balance: emitted = deposited + missed + side + stopped; `side` is
/// there if `integrator.side_light` leaves light out. `channels` has the counts of each wavelength. Of the method
/// "scene", `photons` has the photons of its lights by their end, also for each pass: emitted = before + landed +
/// escaped + stopped; `bent_rays` are those that are followed back, and `samples` those of the picture. `scene` is the
/// path as UTF-8 (path_text.h).
std::string statistics_json(const Scene& scene, const Statistics& statistics, double seconds_writing, int threads);

}  // namespace tensorray
