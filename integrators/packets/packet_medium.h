#pragma once
/// @file integrators/packets/packet_medium.h
/// Data that the kernel's code for all instruction sets shares: the field, and a packet of rays. A part of
/// packet_kernel-inl.h.

#include <cstdint>

#include <Eigen/Core>

#include "integrators/packets/kernel_rays.h"
#include "integrators/steps/composition.h"
#include "integrators/steps/runge_kutta.h"
#include "integrators/steps/step_lengths.h"
#include "volumes/bricks/cubic_brick.h"

namespace tensorray::packets {

/// How bricks hold a field: of voxels, between which it is trilinear, or of coefficients of cubic B-splines. @p stored
/// is the number of components.
template <int stored>
struct LinearBricks : TensorBrick {
  static constexpr int components = stored;
  static constexpr bool cubic = false;
};
template <int stored>
struct CubicBricks : CubicBrick {
  static constexpr int components = stored;
  static constexpr bool cubic = true;
};

/// The field and the settings as the kernel uses them. No member function is inlined into code for an instruction set
/// that the processor may lack.
struct PacketMedium {
  PacketMedium(const TensorField& field, const KernelSettings& settings);

  const TensorField& field;
  const KernelSettings& settings;
  /// Stages of the method; null if it has one sample, at the middle of a step or (Euler) at its beginning.
  const RungeKutta* stages;
  bool composed;  // Whether the method is `splitting4`.
  bool adaptive;
  /// Whether the method is `splitting`, and the field is linear, of voxels that are cubes along the world's axes: index
  /// space is scaled world space. This usual case is faster; other methods and fields have one code for all voxels.
  bool uniform;
  float voxel;          // If uniform: edge of a voxel, world units.
  float unit;           // A power of two near a voxel's edge, world units: squares of lengths in it are not extreme.
  float longest_voxel;  // No voxel is longer along any direction, world units.
  float to_index[3][3];
  std::int32_t first[3], last[3];              // First and last voxels of the extent.
  std::int32_t first_inner[3], last_inner[3];  // No step from these bricks may leave the extent. May be none.
  std::int32_t first_near[3], last_near[3];    // Bricks from which a step may meet a surface. May be none.
  float margin[3];     // Distance of the extent's faces from these voxels: ½ on an axis of a single voxel, else 0.
  bool flat;           // Whether an axis has a single voxel.
  float slope[3];      // 0 along axes with a single voxel, 1 along the others.
  bool clamps;         // Whether sample points of any step may be outside the box of the voxels.
  float longest_kick;  // Longest part of a step that a kick takes, voxels.
  float longest_step;  // Longest step, voxels; steps through straight bricks may be longer.
  float past_straight_brick;  // How far a step through a straight brick goes beyond it, voxels.
  bool bounded;               // Whether the limit of length may end rays within the field.

  TensorBrick brick(const std::int32_t at[3]) const { return field.brick({at[0], at[1], at[2]}); }
  /// Whether a step from a brick may meet a surface.
  bool near_surface(const std::int32_t at[3]) const {
    bool near = true;
    for (int axis = 0; axis < 3; ++axis) near &= at[axis] >= first_near[axis] && at[axis] <= last_near[axis];
    return near;
  }
  bool meets_surface(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

 private:
  void find_bricks_near_surfaces(double margin_of_steps);
};

/// Λ of a kick that is too strong for a series in single precision.
/// @param T  T up to a multiple of I, column by column.
float strong_log_radiance_scale(const float T[9], float factor, const float v[3]);

constexpr float strongest_kick = static_cast<float>(step_lengths::strongest_kick);
/// Voxels. Shorter steps are taken in double precision; splitting never takes them.
constexpr float shortest_step = 1.0f / 1024;
constexpr int landing_steps = 4;           // Steps of Newton's method to a face of the extent.
constexpr int composed_landing_steps = 1;  // The same of `splitting4`, whose path between the ends is known.

/// With n terms the power series of exp(A) V is exact to 3e-9 for ‖A‖ up to entry n − 2: (3e-9 (n + 1)!)^(1/(n + 1)).
/// This error must be smaller than rounding errors: it is the same in every step, and they are not.
constexpr float series_reach[] = {0.00262f, 0.0164f, 0.0514f, 0.1137f, 0.205f,
                                  0.3238f,  0.4688f, 0.6364f, 0.8246f, 1.03f};
constexpr int most_terms = 11;

constexpr int packet_rays = 32;  // Number of rays in a packet: several vectors.
using PerRay = float[packet_rays];

/// Rays side by side, one in each lane. All lanes of its vectors hold a ray, so that no step needs a mask: a lane whose
/// ray has ended repeats another ray.
struct alignas(64) Packet {
  PerRay p[3];          // Position, in voxels from the brick's first voxel.
  PerRay v[3];          // V; unit, world axes.
  PerRay u[3];          // The direction in index space; unused if voxels are uniform, where it is V.
  PerRay kick;          // σ; times the voxel's edge if voxels are uniform.
  PerRay length;        // Length of the path since the ray entered the packet, in units of `time`.
  PerRay bending_rate;  // |kick| times the norm of T's deviator as last sampled, or 0.
  PerRay reach;         // Upper bound of ‖σ h T‖ in the brick.
  PerRay strongest;
  // Only if near_border:
  PerRay low[3], high[3];  // Box of the voxels, relative to the brick.
  PerRay last[3];          // Last cell, relative to the brick.

  // The step that is being taken:
  PerRay time;         // Length of the step: voxels if voxels are uniform, else world units.
  PerRay middle[3];    // Positions of the samples.
  PerRay voxel;        // Number, in the brick, of the first voxel of the sample's cell.
  PerRay fraction[3];  // Position within the cell.
  PerRay tensor[8];    // Tensors of all lanes, component after component.
  PerRay p_next[3], v_next[3], u_next[3];
  // Only if the change of radiance is wanted: Λ since the ray entered the packet, and that of this step.
  PerRay log_radiance_scale, change_of_step;
  // Adaptive methods: the next step, voxels, and the error of this one divided by the tolerance.
  PerRay wanted, excess;

  // Only for rays with differentials: derivatives of p and v along two parameters before the step, in its middle and
  // after it; slopes of the tensor along x, y and z; and ‖σ h T‖ or an upper bound of it.
  PerRay dp[2][3], dv[2][3], dmiddle[2][3], dp_next[2][3], dv_next[2][3];
  PerRay slopes[3][8];
  PerRay size;

  const float* bending[packet_rays] = {};
  alignas(64) std::int32_t brick[3][packet_rays];
  std::int32_t ray[packet_rays];
  std::uint32_t alive = 0;  // One bit for each lane.
  std::uint32_t moved = 0;  // The lanes that have entered other bricks for these samples; may be more.
  std::uint32_t lands = 0;  // The lanes whose step meets a surface, or a face of the extent.
  int vectors = 0;          // Number of vectors in use.
  std::uint32_t steps = 0, most_steps = 0;
  float greatest_reach = 0;
  bool one_brick = false, one_cell = false;
  bool near_border = false;  // Whether a step may leave the extent, or sample points are moved to it.
  bool near_surface = false, straight = false;
  bool varied = false;   // Whether some steps are not of the longest length.
  bool timed = false;    // Whether `time` is already that of the next step.
  bool watched = false;  // Whether a step may end a ray for another reason than the number of steps.
  bool clamps = false;   // Whether points outside the box of the voxels are moved to it.
};

}  // namespace tensorray::packets
