#pragma once
/// @file tracing/steps/path_tensors.h
/// Tensors of the field at the points of a path.

#include "tracing/bending/ray_record.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Sets `tensor` and `change` of the points in the field, in double precision.
/// @param strength  σ = s · scale of light in the path's direction.
void set_tensors(const TensorField& field, double strength, PathPoints& points);

}  // namespace tensorray
