#pragma once
/// @file integrators/bending/step_lengths.h
/// Limits of step lengths, in voxels, for both tracers.

namespace tensorray::step_lengths {

constexpr double longest_automatic = 0.5;
constexpr double shortest_splitting = 1.0 / 64;  ///< Of automatic steps; splitting is stable in any field.
constexpr double strongest_kick = 0.2;           ///< Limit of |σ| h ‖T − ⅓ tr(T) I‖ in an automatic step.
constexpr double longest_adaptive = 2;           ///< So that no step passes over a voxel.
constexpr double shortest_adaptive = 1e-6;

/// A step through a brick where nothing bends light ends this far beyond the brick. Otherwise rounding could keep the
/// ray in it. The second value is for methods that also sample at the end of a step.
constexpr double past_straight_brick = 1.0 / 64, past_straight_brick_by_stages = 1e-5;

/// The next step of an adaptive method is the last step times safety · excess^(-1 / order), limited to the range from
/// least_growth to most_growth. `excess` is the error of the last step divided by the tolerance. If it is NaN, the
/// factor is least_growth.
constexpr double safety = 0.9, least_growth = 0.2, most_growth = 5;
constexpr double least_excess = 1e-10;  ///< Smaller values of `excess` count as this one.

}  // namespace tensorray::step_lengths
