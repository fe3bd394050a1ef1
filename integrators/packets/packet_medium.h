#pragma once
/// @file integrators/packets/packet_medium.h
/// What the kernel's code for every instruction set shares: the field as it sees it, and a packet of rays. A part of
/// packet_kernel.cpp.

#include <cstdint>

#include "integrators/bending/runge_kutta.h"
#include "integrators/bending/step_lengths.h"
#include "integrators/packets/packet_kernel.h"

namespace tensorray::packets {

/// What all targets share. No function of it is inlined into code for a target that the processor may lack.
struct PacketMedium {
  PacketMedium(const TensorField& field, const KernelSettings& settings);

  const TensorField& field;
  const KernelSettings& settings;
  const RungeKutta* stages;  // Of the method; null if it has one, which is at a step's middle or (Euler's) beginning.
  bool adaptive;
  bool uniform;         // Voxels are cubes along the world's axes: index space is world space, scaled.
  float voxel;          // If so, their edge.
  float longest_voxel;  // Along any direction.
  float to_index[3][3];
  std::int32_t first[3], last[3];  // Voxels of the extent.
  float margin[3];                 // Of the extent beyond these: ½ on an axis of a single voxel.
  bool flat;                       // Whether an axis has a single voxel.
  float slope[3];                  // 0 along those axes, 1 along the others.
  bool clamps;                     // Whether points that are sampled may be beyond the voxels' box, always.
  float longest_step;              // Voxels; but through straight bricks.
  float past_straight_brick;       // Voxels.
  bool bounded;                    // Whether rays may end within the field, by their length.

  TensorBrick brick(const std::int32_t at[3]) const { return field.brick({at[0], at[1], at[2]}); }
  bool near_surface(const std::int32_t at[3]) const;
  bool meets_surface(const double from[3], const double to[3]) const;
};

constexpr float strongest_kick = static_cast<float>(step_lengths::strongest_kick);
/// Voxels. Shorter steps, which only other methods than splitting take, are for double precision.
constexpr float shortest_step = 1.0f / 1024;
constexpr int landing_steps = 4;  // Of Newton's method, to a face of the extent.

/// With n terms the power series of exp(A) V is exact to 3e-9 for ‖A‖ up to entry n − 2: (3e-9 (n + 1)!)^(1/(n + 1)).
/// That is less than rounding, as the error is the same in every step where rounding is not.
constexpr float series_reach[] = {0.00262f, 0.0164f, 0.0514f, 0.1137f, 0.205f,
                                  0.3238f,  0.4688f, 0.6364f, 0.8246f, 1.03f};
constexpr int most_terms = 11;

constexpr int packet_rays = 32;  // A packet's: several vectors of them.
using PerRay = float[packet_rays];

/// Rays side by side, a lane each. All lanes of its vectors hold a ray: those whose ray has ended repeat that of
/// another, so that no step needs a mask.
struct alignas(64) Packet {
  PerRay p[3];          // Position, voxels from the brick's first.
  PerRay v[3];          // V.
  PerRay u[3];          // The direction in index space; unused if voxels are uniform: it is V.
  PerRay kick;          // σ, times the voxel's edge if voxels are uniform.
  PerRay length;        // Of the way since the ray came, in units of the time that u is per.
  PerRay bending_rate;  // σ times the norm of T's deviator as last sampled, or 0.
  PerRay reach;         // Bound on ‖σ h T‖ in the brick.
  PerRay strongest;
  PerRay low[3], high[3];  // The voxels' box, relative to the brick.
  PerRay last[3];          // The last cell, likewise.

  // Of the step being taken:
  PerRay time;                        // In units of what u is per.
  PerRay middle[3];                   // Positions there;
  PerRay voxel;                       // the number, in the brick, of the cell's first voxel,
  PerRay weights[8];                  // and the weights of the cell's corners, or,
  PerRay fraction[3];                 // of rays with differentials, the position within the cell.
  float components[packet_rays * 8];  // The tensors of lanes in several cells;
  PerRay tensor[8];                   // of all, component after component.
  PerRay p_next[3], v_next[3], u_next[3];
  PerRay wanted, excess;  // Of adaptive methods: the next step, voxels, and this one's error over what is allowed.

  // Only of rays with differentials: p and v along two parameters, now, in the middle of the step and after it, the
  // slopes of the tensor along x, y and z, and ‖σ h T‖ or a bound on it.
  PerRay dp[2][3], dv[2][3], dmiddle[2][3], dp_next[2][3], dv_next[2][3];
  PerRay slopes[3][8];
  PerRay size;

  const float* bending[packet_rays] = {};
  alignas(64) std::int32_t brick[3][packet_rays];
  std::int32_t ray[packet_rays];
  std::uint32_t alive = 0;  // A bit each.
  int vectors = 0;          // In use.
  std::uint32_t steps = 0, most_steps = 0;
  float greatest_reach = 0;
  bool one_brick = false, one_cell = false;
  bool near_border = false, near_surface = false, straight = false;
  bool varied = false;   // Whether steps are not all of the longest length, ...
  bool timed = false;    // and whether `time` is that of the next step already.
  bool watched = false;  // Whether a step may end a ray, but for their number.
  bool clamps = false;   // Whether points beyond the voxels' box are taken to it.
};

}  // namespace tensorray::packets
