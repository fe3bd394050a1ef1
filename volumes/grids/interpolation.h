#pragma once
/// @file volumes/grids/interpolation.h
/// What a field is between its voxels.

namespace tensorray {

enum class Interpolation {
  /// Trilinear: continuous, with kinks at the faces of cells. Exact for fields that are linear along each axis.
  linear,
  /// The tricubic B-spline that has the voxels' values at the voxels: twice continuously differentiable (M. Unser,
  /// Splines: a perfect fit for signal and image processing, 1999). Exact for cubic polynomials along each axis, up to
  /// the faces of the extent, where values are extrapolated.
  cubic
};

/// What `cubic` takes inactive voxels for that are within its reach of active ones.
enum class Border {
  fade,   ///< A fifth of the active neighbour's value, then zero: the field fades out over two voxels.
  extend  ///< The continuation of the active voxels' values, so that the field goes on behind the last active voxel.
};

struct Interpolant {
  Interpolation between = Interpolation::linear;
  Border border = Border::fade;
};

inline bool operator==(const Interpolant& a, const Interpolant& b) {
  return a.between == b.between && (a.border == b.border || a.between == Interpolation::linear);
}
inline bool operator!=(const Interpolant& a, const Interpolant& b) { return !(a == b); }

}  // namespace tensorray
