#pragma once
/// @file integrators/bending/step_lengths.h
/// What both tracers hold steps to, in voxels.

namespace tensorray::step_lengths {

constexpr double longest_automatic = 0.5;
constexpr double shortest_splitting = 1.0 / 64;  ///< Automatic: the splitting is stable however strong the field.
constexpr double strongest_kick = 0.2;           ///< s h ‖T − ⅓ tr(T) I‖ of an automatic step.
constexpr double longest_adaptive = 2;           ///< So that no voxel is stepped over.
constexpr double shortest_adaptive = 1e-6;

/// A step through a brick where nothing bends light ends a little behind it, so that rounding does not keep light
/// there; the second is for methods that sample also at a step's end.
constexpr double past_straight_brick = 1.0 / 64, past_straight_brick_by_stages = 1e-5;

/// The next step of an adaptive method is the last one times safety · excess^(-1 / order), between the least and the
/// most growth; `excess` is the last one's error over what is allowed. NaN: the least.
constexpr double safety = 0.9, least_growth = 0.2, most_growth = 5;
constexpr double least_excess = 1e-10;  ///< Taken instead of smaller ones.

}  // namespace tensorray::step_lengths
