#pragma once
/// How the steps of rays turn polarisation: rays side by side, then wavelengths side by side.

#include <cstddef>
#include <vector>

namespace tensorray {

constexpr int ray_lanes = 16;  ///< Rays side by side.

/// Steps of parallel rays, one of each ray.
struct RaySteps {
  double origin[3][ray_lanes];             ///< Of the rays, index space.
  double place[2][ray_lanes];              ///< The step's Gauss points, along the ray from its origin.
  float length[ray_lanes];                 ///< 0: the ray has no step.
  float a[2][ray_lanes], b[2][ray_lanes];  ///< At the Gauss points (differences.h).
};

/// Gauss' points of a step are before and behind its middle by this part of its length.
constexpr double gauss_point = 0.28867513459481287;

/// What steps of rays do to light of relative strength g, the phase by which a wavelength is turned compared with the
/// one that is turned most (−1 ≤ g ≤ 1). The matrix of a step is the exponential of
///   −i (g α σ_z + g β σ_x + g² γ σ_y),
/// Magnus' exponent of fourth order, whose last part is the turning of the axes.
struct RayTurns {
  float alpha[ray_lanes], beta[ray_lanes], gamma[ray_lanes];  ///< Of a part of the step: its angle is small, ...
  int squares[ray_lanes];                                     ///< ... and its matrix is squared so many times.
  float phase[ray_lanes];                                     ///< ∫√(a² + b²) dz of the whole step.
  int joined[ray_lanes];  ///< Whether α, β and γ are also those of the step before.
};

/// Those of a ray: of one step, or of several with small angles.
struct Turn {
  float alpha, beta, gamma;
  int squares;
};

/// Sets the turns of steps. They are joined to those of the steps before where the series of Baker, Campbell and
/// Hausdorff leaves out less than 1e-6.
/// @param steps  With a and b of g = 1. @param turns  Before: of the steps before; at first 0.
void add_turns(const RaySteps& steps, RayTurns& turns);

/// Arrays of wavelengths have room for this count of numbers.
constexpr std::size_t turning_room(std::size_t count) { return (count + 15) / 16 * 16; }

/// Finds the product of a ray's turns, as quaternions of unit length (elements.h), and adds their rotations, times
/// `weight`, and the weight itself.
/// @param turns  In the order of the light. @param strengths  g of as many wavelengths as there is `room`.
/// @param quaternions  w, x, y, z: each `room` numbers. @param light  Ten planes of `room` numbers (LightRow).
void turn(const std::vector<Turn>& turns, const float* strengths, std::size_t room, float weight, float* quaternions,
          float* light);

}  // namespace tensorray
