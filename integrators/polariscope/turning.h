#pragma once
/// @file integrators/polariscope/turning.h
/// How a ray's steps turn polarisation, for many wavelengths side by side.

#include <cstddef>
#include <vector>

namespace tensorray {

/// For light of relative strength g (the phase by which a wavelength is turned, compared with a reference), the matrix
/// of a step is the exponential of
///   −i (g α σ_z + g β σ_x + g² γ σ_y),
/// Magnus' exponent of fourth order, whose last part is the turning of the axes.
struct TurningStep {
  float alpha, beta, gamma;  ///< Divided by 2 to the power of `halvings`, so that the exponent is at most 1.
  int halvings;
};

/// Steps of a ray, in the order of the light.
struct TurningSteps {
  double greatest = 1;  ///< Absolute value of all strengths, at most.
  std::vector<TurningStep> steps;

  /// A step of length h, from a and b at its two Gauss points.
  void add(double h, double a1, double b1, double a2, double b2);
};

/// Gauss' points of a step are before and behind its middle by this part of its length.
constexpr double gauss_point = 0.28867513459481287;

/// Arrays of wavelengths have room for this count of numbers.
constexpr std::size_t turning_room(std::size_t count) { return (count + 15) / 16 * 16; }

/// The products of the steps' matrices, as quaternions (elements.h) of unit length.
/// @param strengths  As many as there is `room`. @param planes  w, x, y, z: each `room` numbers.
void turn(const TurningSteps& steps, const float* strengths, std::size_t room, float* planes);

/// Adds the rotations of quaternions, times `weight`: nine planes, row by row.
void add_rotations(const float* planes, float weight, std::size_t room, float* rotations);

}  // namespace tensorray
