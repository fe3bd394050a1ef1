#pragma once
/// @file integrators/polariscope/turning.h
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

/// What parts of rays do to light of relative strength g, the phase by which a wavelength is turned compared with a
/// reference. The matrix of a step is the exponential of
///   −i (g α σ_z + g β σ_x + g² γ σ_y),
/// Magnus' exponent of fourth order, whose last part is the turning of the axes. With u = w + i z and v = x − i y for
/// its quaternion (elements.h), products of such are power series in g, which all wavelengths share:
///   u = 1 + Σ u_m g^(2m+2),  v = Σ v_m g^(2m+1),  m = 0 to 3.
struct RayTurns {
  float series[2][4][2][ray_lanes];  ///< u, then v; m; real, then imaginary parts.
  float angle[ray_lanes];            ///< Of all steps, for the greatest strength. Where it is 0, nothing turns.
  float squares[ray_lanes];          ///< The quaternion is squared so many times.
};

/// Adds a step of each ray. @param turns  In the order of the light. @param greatest  Of the strengths.
void add_steps(const RaySteps& steps, double greatest, std::vector<RayTurns>& turns);

/// Arrays of wavelengths have room for this count of numbers.
constexpr std::size_t turning_room(std::size_t count) { return (count + 15) / 16 * 16; }

/// The products of a ray's turns, as quaternions of unit length.
/// @param strengths  As many as there is `room`. @param planes  w, x, y, z: each `room` numbers.
void turn(const std::vector<RayTurns>& turns, std::size_t ray, const float* strengths, std::size_t room, float* planes);

/// Adds the rotations of quaternions, times `weight`: nine planes, row by row.
void add_rotations(const float* planes, float weight, std::size_t room, float* rotations);

}  // namespace tensorray
