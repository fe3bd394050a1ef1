#pragma once
/// @file scenes/lens/load_lens.h
/// What a lens needs beside the field: the image, where it stands, and from where it is seen.

#include <vector>

#include "renderer/surfaces/plate.h"
#include "renderer/textures/texture.h"
#include "scenes/lens/lens_description.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// Rectangles are as the viewer sees them, who looks against the light: their normals point along it.
struct LensScene {
  Texture image;
  Plate receiver;
  std::vector<Plate> planes;  ///< Of the image: a picture each, side by side.
  bool wraps = false;         ///< Whether the image goes on beyond its edges.
};

/// @throw std::runtime_error if the image cannot be read; SceneError if it would stand behind the receiver.
LensScene load_lens(const Scene& scene, const LensDescription& lens);

}  // namespace tensorray
