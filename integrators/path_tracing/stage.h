#pragma once
/// @file integrators/path_tracing/stage.h
/// What all pictures of surfaces share: the settings of the path tracer, visible lamps, and the channels of the
/// picture.

#include <functional>
#include <string>
#include <vector>

#include "base/process/progress.h"
#include "integrators/path_tracing/load_paths.h"
#include "renderer/camera/path_tracer.h"
#include "renderer/images/image.h"
#include "renderer/lights/lights.h"
#include "renderer/materials/material.h"
#include "renderer/surfaces/surface.h"
#include "scenes/description/description.h"
#include "scenes/description/method.h"
#include "scenes/scene/render.h"

namespace tensorray {

PathTracerSettings tracer_settings(const SceneDescription& scene, const PathTracingDescription& description);

/// The groups of the scene's lights.
struct LightGroups {
  std::vector<std::string> names;
  std::vector<int> of_light;  ///< Index of each light's group, or −1.
};

LightGroups light_groups(const SceneDescription& scene);

void set_groups(const LightGroups& groups, ShadedScene& scene);

/// What the channels of the picture are. @param bent  Those that it has only if light bends; otherwise the others.
std::vector<ChannelText> surface_channel_texts(bool bent);

/// The picture with all channels that it has.
Image make_image(const SurfacePicture& picture, const ShownLight& light, const PathTracingDescription& description,
                 const LightGroups& groups);

/// @param finish  Completes a render, which is then shown, by the picture so far.
RenderCallbacks callbacks_of(const Progress& progress, RenderJob* job,
                             const std::function<Render(const SurfacePicture&)>& finish);

/// Adds the area lights as surfaces, so that they are visible.
void add_lamps(const std::vector<Light>& lights, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
               std::vector<Material>& materials);

}  // namespace tensorray
