#pragma once
/// How ranks (`mpirun -n 4 tensorray render`) get the scene that the root has read, and what they do with it.

#include "tools/rendering/render_scene.h"

namespace tensorray {

/// Gives the others a scene, so that all load it at the same time. At the root.
void send_scene(Ranks& ranks, const SceneDescription& description, const RenderRun& run);

/// What all ranks of a render have in common, when they have loaded it: at the root, what the scene belongs to, and
/// earlier results. Of others, the scene must be that of the root. @throw SceneError that names the difference.
void agree(Ranks& ranks, const Scene& scene, Results& earlier);

/// Renders with the root what it reads. At the other ranks.
/// @throw as render_scene. Where the root fails, it says so, and this rank waits until mpirun ends it.
void render_with_root(Ranks& ranks, const RenderRun& run, Progress& progress);

}  // namespace tensorray
