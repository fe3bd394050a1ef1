#pragma once
/// @file integrators/polariscope/turning.h
/// How the steps of rays turn polarisation: rays side by side, then wavelengths side by side.

#include <array>
#include <cstddef>
#include <vector>

namespace tensorray {

constexpr int ray_lanes = 16;  ///< Rays side by side.

/// Gauss' points of a step are before and behind its middle by this part of its length.
constexpr double gauss_point = 0.28867513459481287;

/// The quaternion (elements.h) of a part of a ray for light of relative strength g, the phase by which a wavelength is
/// turned compared with a reference. A step's is the exponential of
///   −i (g α σ_z + g β σ_x + g² γ σ_y),
/// Magnus' exponent of fourth order, whose last part is the turning of the axes. Products of such are power series in
/// g, which all wavelengths share:
///   w = 1 + Σ w_m g^(2m+2),  x = Σ x_m g^(2m+1),  y likewise,  z = Σ z_m g^(2m+2).
struct Turn {
  float w[4], x[4], y[4], z[4];
  int squares;  ///< The quaternion is squared so many times.
};

/// Turns side by side, which may take more steps.
struct OpenTurns {
  float series[4][4][ray_lanes];               ///< w, x, y, z of a Turn.
  float angle[ray_lanes], squares[ray_lanes];  ///< For the greatest strength, at most.
};

/// The turns along rays, in the order of the light.
class RayTurns {
 public:
  double greatest = 1;  ///< Absolute value of all strengths, at most.
  std::array<std::vector<Turn>, ray_lanes> turns;

  void restart();

  /// A step of each ray, from its length and from a and b at its two Gauss points.
  void add(const float (&length)[ray_lanes], const float (&a)[2][ray_lanes], const float (&b)[2][ray_lanes]);

  /// After the last step.
  void finish();

 private:
  void close(const OpenTurns& which, std::size_t ray);

  OpenTurns open_{};
};

/// Arrays of wavelengths have room for this count of numbers.
constexpr std::size_t turning_room(std::size_t count) { return (count + 15) / 16 * 16; }

/// The products of turns, as quaternions of unit length.
/// @param strengths  As many as there is `room`. @param planes  w, x, y, z: each `room` numbers.
void turn(const std::vector<Turn>& turns, const float* strengths, std::size_t room, float* planes);

/// Adds the rotations of quaternions, times `weight`: nine planes, row by row.
void add_rotations(const float* planes, float weight, std::size_t room, float* rotations);

/// The sums over wavelengths of `planes` planes times three colours, of which each has `room` numbers: sums[3 p + c].
void sum_colors(const float* rotations, std::size_t planes, const float* colors, std::size_t room, float* sums);

}  // namespace tensorray
