#pragma once
/// @file scenes/photons/plate_map.h
/// How the flow map of a scene lies on its plate, pixel by pixel.

#include "base/team.h"
#include "integrators/flow/flow_map.h"
#include "renderer/images/image.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The channels displacement.x, .y, .z, magnification.log, .major, .minor, .angle, folds, length and error of the light
/// of the band nearest to 550 nm (in RGB mode: green) at the centre of each pixel; see docs/scenes.md. All are 0 where
/// no light lands. Where the map folds, they describe the sheet that is displaced least.
/// @param map   To the plate of the scene. Runs on all threads; the result does not depend on their number.
/// @param team  Processes that have the same map and do this together, for process 0; null: alone.
Image plate_map(const FlowMap& map, const Scene& scene, Team* team = nullptr);

}  // namespace tensorray
