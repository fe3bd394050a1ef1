#pragma once
/// @file integrators/photon_distribution/plate_map.h
/// How the flow map of a scene lies on its plate, pixel by pixel.

#include <vector>

#include "base/process/job.h"
#include "renderer/images/image.h"
#include "scenes/description/method.h"
#include "scenes/scene/scene.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

/// What the channels of plate_map are.
std::vector<ChannelText> plate_map_texts();

/// How the light of the band nearest to 550 nm (in RGB mode: green) lands at the centre of each pixel. All channels are
/// 0 where no light lands. Where the map folds, they describe the sheet that is displaced least.
/// @param map   To the plate of the scene. Runs on all threads; the result does not depend on their number.
/// @param job   Whose ranks have the same map and do this together, for the root; null: alone.
Image plate_map(const FlowMap& map, const Scene& scene, const Progress& progress, Job* job = nullptr);

}  // namespace tensorray
