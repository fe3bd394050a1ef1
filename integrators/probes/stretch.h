#pragma once
/// @file integrators/probes/stretch.h
/// How fast a field pulls neighbouring rays of parallel light apart: the finite-time Lyapunov exponent (G. Haller,
/// Distinguished material surfaces and coherent structures in three-dimensional fluid flows, Physica D 149, 2001) of
/// the flow that light is, with the length of the way for time.

#include <vector>

#include <Eigen/Core>

#include "base/progress.h"
#include "integrators/bending/bending.h"
#include "renderer/surfaces/plate.h"
#include "volumes/grids/scalar_grid.h"

namespace tensorray {

/// The stretch at P₀ is ln σ / L, where σ is the greatest singular value of ∂P(L)/∂P₀: P(L) is where the ray from P₀
/// is after the length L of its way, and P₀ moves across the light. 1/length: two rays part by exp(L · stretch). 0
/// where light goes straight; negative where all neighbours come nearer. Behind the volume rays go on straight.
struct StretchSettings {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Of the light where it starts; unit.
  double flexibility = 0.2;                               ///< s.
  double length = 1;                                      ///< L, world units; > 0.
};

/// At each start, in the volume or outside. Not a number where the ray does not come so far (it ends on an obstacle, or
/// cannot be followed), or does not meet the volume.
/// @param geometry  Bounds, cut and obstacles; on a plate rays would end.
/// Any number of threads may call it. @throw std::invalid_argument if a setting is out of range.
std::vector<float> stretches(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                             const StretchSettings& settings, const std::vector<Eigen::Vector3d>& starts);

/// From every point of a lattice in the volume, along the axes of the field's voxels; inactive where there is none.
/// @param resolution  Voxels along the extent's longest side in index space; those along the others are as far apart.
/// The same for any number of threads. @throw std::invalid_argument if a setting is out of range; Cancelled.
ScalarGrid stretch_grid(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                        const StretchSettings& settings, int resolution, const Progress& progress);

/// From every pixel of a rectangle, row by row. The same for any number of threads. @throw as stretch_grid.
std::vector<float> stretch_picture(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                                   const StretchSettings& settings, const Plate& pixels, const Progress& progress);

}  // namespace tensorray
