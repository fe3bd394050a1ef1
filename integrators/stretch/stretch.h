#pragma once
/// How fast a field separates neighbouring rays of parallel light: the finite-time Lyapunov exponent (G. Haller,
/// Distinguished material surfaces and coherent structures in three-dimensional fluid flows, Physica D 149, 2001) of
/// the flow along the rays. Length along the ray takes the place of time.

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "base/process/progress.h"
#include "renderer/surfaces/plate.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "volumes/grids/tensor_grid.h"

namespace tensorray {

class Job;

/// The stretch at P₀ is ln σ / L, in 1/length, where σ is the greatest singular value of ∂P(L)/∂P₀. P(L) is the point
/// of the ray from P₀ at length L, and P₀ moves across the light. The distance of two rays grows by a factor of at most
/// exp(L · stretch). The stretch is 0 where light goes straight, and negative where all neighbours come nearer.
struct StretchSettings {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Direction of the light at its start; unit.
  double flexibility = 0.2;                               ///< s.
  double length = 1;                                      ///< L, world units; > 0.

  Job* job = nullptr;  ///< Keeps rows of pictures, and columns of blocks of grids, its units; null: alone. Of a shard,
                       ///< the others are NaN. Only the root of its ranks has the result.

  /// Called from time to time with the picture so far, where it is NaN beyond; empty: nobody wants it.
  std::function<void(const std::vector<float>& picture)> show;
};

/// The stretch at each start, inside or outside the volume. NaN where the ray does not reach the length (it ends on an
/// obstacle, or cannot be followed), or does not meet the volume.
/// @param geometry  Bounds, cut and obstacles; without a plate, on which rays would end.
/// Threads: any number may call it at once. @throw std::invalid_argument if a setting is out of range.
std::vector<float> stretches(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                             const StretchSettings& settings, const std::vector<Eigen::Vector3d>& starts);

/// The stretch at every point of a lattice in the volume, along the voxels' axes. Voxels without a value are inactive.
/// @param resolution  Voxels along the longest side of the extent in index space; the spacing is the same on all axes.
/// @throw std::invalid_argument if a setting is out of range; Cancelled; as Ranks::gather.
ScalarGrid stretch_grid(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                        const StretchSettings& settings, int resolution, const Progress& progress);

/// The stretch at every pixel of a rectangle, row by row. @throw as stretch_grid.
std::vector<float> stretch_picture(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                                   const StretchSettings& settings, const Plate& pixels, const Progress& progress);

}  // namespace tensorray
