#pragma once
/// @file integrators/lens/lens_obstacles.h
/// Draws the obstacles of a scene behind the picture of a lens.

#include "integrators/lens/lens.h"
#include "renderer/images/image.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

/// Adds the obstacles between the receiver and the plane of the image to a picture with the receiver's resolution,
/// where its alpha is less than 1: as the viewer sees them straight along its lines of sight, by light that comes from
/// there.
/// @param surfaces  Their obstacles are drawn. @param samples  Of a pixel along x and along y.
/// @param image  Its first channels are R, G and B, multiplied by alpha, and A.
/// @throw std::runtime_error if Embree fails.
void draw_obstacles(const Surfaces& surfaces, const LensSetup& setup, int samples, Image& image);

}  // namespace tensorray
