#pragma once
/// @file integrators/lens/load_lens.h
/// What a lens needs in addition to the field: the image, its position, and the plate from which it is seen.

#include <vector>

#include "integrators/lens/lens_method.h"
#include "renderer/surfaces/plate.h"
#include "renderer/textures/texture.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The viewer looks against the light, so that the normals of both rectangles point along the light.
struct LensScene {
  Texture image;
  Plate receiver;
  std::vector<Plate> planes;  ///< Planes of the image. Each gives a picture; they are side by side.
  bool wraps = false;         ///< Whether the image continues beyond its edges.
};

/// @throw std::runtime_error if the image cannot be read; SceneError if the image would be behind the receiver.
LensScene load_lens(const Scene& scene, const LensDescription& lens, std::vector<std::string>& notes);

}  // namespace tensorray
