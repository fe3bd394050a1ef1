#pragma once
/// Scenes in which y is up: all that their files hold is turned when it is read, so that z is up while the program
/// computes, and turned back when it is written. (The reader turns the vectors of the scene itself.)

#include <vector>

#include "scenes/description/description.h"
#include "scenes/scene/render.h"
#include "tracing/paths/paths.h"
#include "volumes/grids/block_source.h"

namespace tensorray {

// @param turn  A rotation.

/// A field: its places, tensors and surface.
BlockSource turned(BlockSource field, const Eigen::Matrix3d& turn);

/// What is made of a scene: photons, grids, paths, and the vectors in the channels of its picture.
Render turned(Render render, const Eigen::Matrix3d& turn);

void turn_paths(std::vector<Path>& paths, const Eigen::Matrix3d& turn);

}  // namespace tensorray
