#pragma once
/// @file scenes/load_lens.h
/// What a lens needs beside the field: the image, where it stands, and from where it is seen.

#include <vector>

#include "renderer/color/color.h"
#include "renderer/surfaces/plate.h"
#include "renderer/textures/texture.h"
#include "scenes/description.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Rectangles are as the viewer sees them, who looks against the light: their normals point along it.
struct LensScene {
  Texture image;
  Plate receiver;
  std::vector<Plate> planes;  ///< Of the image: a picture each, side by side.
  bool wraps = false;         ///< Whether the image goes on beyond its edges.
};

/// @param direction  Of the light, unit.
/// @param plate      The receiver as photons see it, along the light.
/// @throw std::runtime_error if the image cannot be read; SceneError if it would stand behind the receiver.
LensScene load_lens(const SceneDescription& description, const TensorField& field, const ColorManagement& color,
                    const Eigen::Vector3d& direction, const Plate& plate);

}  // namespace tensorray
