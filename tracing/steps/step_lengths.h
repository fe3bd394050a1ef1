#pragma once
/// @file tracing/steps/step_lengths.h
/// Limits of step lengths, in voxels, for both tracers.

namespace tensorray::step_lengths {

constexpr double longest_automatic = 0.5;
constexpr double shortest_splitting = 1.0 / 64;  ///< Of automatic steps; splitting is stable in any field.
constexpr double strongest_kick = 0.2;           ///< Limit of |σ| h ‖T − ⅓ tr(T) I‖ in an automatic step.
constexpr double longest_adaptive = 2;           ///< So that no step passes over a voxel.
constexpr double shortest_adaptive = 1e-6;
constexpr double longest_composed = 6;       ///< Of automatic steps of `splitting4`: its samples are then 2.1 apart.
constexpr double strongest_composed = 1.25;  ///< As strongest_kick, for its first step.

/// A step through a brick where nothing bends light ends this far beyond the brick. Otherwise rounding could keep the
/// ray in it. The second value is for methods that also sample at the end of a step.
constexpr double past_straight_brick = 1.0 / 64, past_straight_brick_by_stages = 1e-5;

/// The next step of an adaptive method is the last step times safety · excess^(-1 / order), limited to the range from
/// min_growth to max_growth. `excess` is the error of the last step divided by the tolerance. If it is NaN, the
/// factor is min_growth.
constexpr double safety = 0.9, min_growth = 0.2, max_growth = 5;
constexpr double composed_safety = 0.7;  ///< Of `splitting4`: steps are then hardly ever repeated, so that rays depend
                                         ///< smoothly on their start and flexibility.
constexpr int composed_order = 4;
constexpr double min_excess = 1e-10;  ///< Smaller values of `excess` count as this one.

}  // namespace tensorray::step_lengths
