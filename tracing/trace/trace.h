#pragma once
/// Follows rays through a tensor field.

#include <vector>

#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Follows every ray of `batch` to its end, in place: position and direction become those at the end. A ray that missed
/// stays where it last crossed the bounds (or where it started), unless there is a `max_length`. Differentials follow
/// the variational equations; they are the derivatives of the method's own steps. On a surface they are the derivatives
/// of the point where rays meet it, so that those of the position lie in the surface.
/// @param field     World frame; s · scale · T in 1/length. Light goes straight outside its extent and outside the cut.
/// @param geometry  Bounds (those of the field), cut, plate and obstacles.
/// @param records   Set to the points of each ray, at little cost; null: not recorded. Rays are the same with and
///                  without it. Records keep the memory that they have.
/// Accuracy: the method's order on smooth fields, 2 on trilinear data. A cubic field has kinks in its third
/// derivatives: at steps much shorter than its voxels the order is 4 at most. Entry, exit and hits are located by
/// repeating the step with the length that ends on the surface, which keeps the order. Threads: `field` and `geometry`
/// are shared and immutable; one batch belongs to one thread.
/// @throw std::invalid_argument if a setting is out of range.
void trace(const TensorField& field, const Geometry& geometry, const BendingSettings& settings, RayBatch& batch,
           std::vector<RayRecord>* records = nullptr);

/// The same, one ray at a time and in double precision. Tests compare `trace` with this reference.
void trace_reference(const TensorField& field, const Geometry& geometry, const BendingSettings& settings,
                     RayBatch& batch);

}  // namespace tensorray
