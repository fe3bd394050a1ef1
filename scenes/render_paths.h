#pragma once
/// @file scenes/render_paths.h
/// Pictures of a scene's bent rays.

#include "scenes/render.h"

namespace tensorray {

/// @pre The scene's integrator is path tracing. @throw as `render`.
Render render_paths(const Scene& scene, const Progress& progress);

}  // namespace tensorray
