#pragma once
/// @file renderer/film/image_distance.h
/// How far two pictures are apart.

#include "renderer/images/image.h"

namespace tensorray {

/// The root of the sum of squared differences, as a part of that of `exact`, in the first three channels (the colours)
/// or as many as there are; 0 if `exact` is black.
/// @throw std::invalid_argument if the pictures differ in size or in their number of colours.
double relative_distance(const Image& image, const Image& exact);

}  // namespace tensorray
