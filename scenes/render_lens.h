#pragma once
/// @file scenes/render_lens.h
/// The lens simulation of a scene.

#include "scenes/render.h"

namespace tensorray {

/// @pre The scene's integrator is the lens. @throw as `render`.
Render render_lens(const Scene& scene, const Progress& progress);

}  // namespace tensorray
