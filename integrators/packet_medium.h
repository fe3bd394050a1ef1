#pragma once
/// @file integrators/packet_medium.h
/// What the kernel's code for every instruction set shares: the field as it sees it, and a packet of rays. A part of
/// packet_kernel.cpp.

#include <cstdint>

#include "integrators/packet_kernel.h"

namespace tensorray::packets {

/// What all targets share. No function of it is inlined into code for a target that the processor may lack.
struct Medium {
  Medium(const TensorField& field, const KernelSettings& settings);

  const TensorField& field;
  const KernelSettings& settings;
  bool uniform;         // Voxels are cubes along the world's axes: index space is world space, scaled.
  float voxel;          // If so, their edge.
  float longest_voxel;  // Along any direction.
  float to_index[3][3];
  std::int32_t first[3], last[3];  // Voxels of the extent.
  float margin[3];                 // Of the extent beyond these: ½ on an axis of a single voxel.
  bool flat;                       // Whether an axis has a single voxel.
  float slope[3];                  // 0 along those axes, 1 along the others.
  float longest_step;              // Voxels; but through straight bricks.

  TensorBrick brick(const std::int32_t at[3]) const { return field.brick({at[0], at[1], at[2]}); }
  bool near_surface(const std::int32_t at[3]) const;
  bool meets_surface(const double from[3], const double to[3]) const;

  /// exp(factor · T) V, normalised; zero if it has no direction.
  static void exponential(const float T[8], float factor, float V[3]);
};

constexpr int most_lanes = 16;
constexpr float longest_automatic_step = 0.5f, shortest_automatic_step = 1.0f / 64;  // Voxels; as in scalar_tracer.cpp.
constexpr float strongest_kick = 0.2f;
constexpr float past_straight_brick = 1.0f / 64;
constexpr int landing_steps = 4;  // Of Newton's method, to a face of the extent.

/// With n terms the power series of exp(A) V is exact to 3e-9 for ‖A‖ up to entry n − 2: (3e-9 (n + 1)!)^(1/(n + 1)).
/// That is less than rounding, as the error is the same in every step where rounding is not.
constexpr float series_reach[] = {0.00262f, 0.0164f, 0.0514f, 0.1137f, 0.205f,
                                  0.3238f,  0.4688f, 0.6364f, 0.8246f, 1.03f};
constexpr int most_terms = 11;

/// Rays side by side, one a lane. All lanes hold a ray: those whose ray has ended repeat that of another, so that no
/// step needs a mask.
struct Packet {
  alignas(64) float p[3][most_lanes];          // Position, voxels from the brick's first.
  alignas(64) float v[3][most_lanes];          // V.
  alignas(64) float u[3][most_lanes];          // The direction in index space; unused if voxels are uniform: it is V.
  alignas(64) float kick[most_lanes];          // s, times the voxel's edge if voxels are uniform.
  alignas(64) float length[most_lanes];        // Of the way since the ray came, in units of the time that u is per.
  alignas(64) float bending_rate[most_lanes];  // s times the norm of T's deviator as last sampled, or 0.
  alignas(64) float reach[most_lanes];         // Bound on ‖s h T‖ in the brick.
  alignas(64) float strongest[most_lanes];
  alignas(64) float low[3][most_lanes], high[3][most_lanes];  // The voxels' box, relative to the brick.
  alignas(64) float last[3][most_lanes];                      // The last cell, likewise.

  // Of the step being taken:
  alignas(64) float time[most_lanes];              // In units of what u is per.
  alignas(64) float middle[3][most_lanes];         // Positions there ...
  alignas(64) float fraction[3][most_lanes];       // ... and within the cell;
  alignas(64) float polynomial[8][8];              // the cell's, if it is one_cell,
  alignas(64) float components[2][most_lanes][4];  // or each lane's tensor;
  alignas(64) float tensor[8][most_lanes];         // the same, lanes side by side.

  // Only of rays with differentials: p and v along two parameters, now, in the middle of the step and after it, the
  // slopes of the tensor along x, y and z, and ‖s h T‖ or a bound on it.
  alignas(64) float dp[2][3][most_lanes], dv[2][3][most_lanes], dmiddle[2][3][most_lanes];
  alignas(64) float dp_next[2][3][most_lanes], dv_next[2][3][most_lanes];
  alignas(64) float slope_components[3][2][most_lanes][4], slopes[3][8][most_lanes];
  alignas(64) float size[most_lanes];

  const float* bending[most_lanes] = {};
  alignas(64) std::int32_t brick[3][most_lanes];
  std::int32_t ray[most_lanes];
  std::uint32_t alive = 0;  // A bit each.
  std::uint32_t steps = 0, most_steps = 0;
  float greatest_reach = 0;
  bool one_brick = false, near_border = false, near_surface = false, straight = false, one_cell = false;
  bool clamps = false;  // Whether points beyond the voxels' box are taken to it.
};

}  // namespace tensorray::packets
