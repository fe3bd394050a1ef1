#pragma once
/// What the kernel's code for all instruction sets shares: the field, a packet of rays, and what only few rays need,
/// which is computed one by one in double precision.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "tracing/kernels/packet_kernel.h"
#include "tracing/steps/methods.h"
#include "volumes/bricks/brick_layout.h"

namespace tensorray::packets {

/// The field and the settings as the kernel uses them. No member function is inlined into code for an instruction set
/// that the processor may lack.
struct PacketMedium {
  PacketMedium(const TensorField& field, const KernelSettings& settings);

  const TensorField& field;
  const KernelSettings& settings;
  const Composition& method;
  bool adaptive;       // Whether the error sets the lengths of steps.
  bool bounded;        // Whether the limit of length may end rays within the field.
  bool levels;         // Whether the field has finer levels than level 0.
  float unit;          // A power of two near a voxel's edge, world units: squares of lengths in it are not extreme.
  float longest_step;  // Voxels of the leaf; steps through straight bricks may be longer.
  float longest_kick;  // Longest part of a step that a kick takes, world units.
  float to_index[3][3];
  std::int32_t first[3], last[3];            // First and last voxels of the extent.
  std::int32_t first_near[3], last_near[3];  // Bricks from which a step may meet a surface. May be none.
  float margin[3];  // Distance of the extent's faces from these voxels: ½ on an axis of a single voxel, else 0.
  float slope[3];   // 0 along axes with a single voxel, 1 along the others.

  TensorBrick brick(const std::int32_t at[3]) const { return field.brick({at[0], at[1], at[2]}); }
  LeafBrick leaf(const std::int32_t at[3], const std::array<float, 3>& position) const {
    return field.leaf({at[0], at[1], at[2]}, position);
  }
};

/// From this ‖σ h T‖ on, the norm of a kick is computed; below, its bound in the brick is used.
constexpr float strongest_kick = static_cast<float>(step_lengths::strongest_kick);
/// Voxels. Shorter steps are taken in double precision.
constexpr float shortest_step = 1.0f / 1024;

/// With n terms the power series of exp(A) V is exact to 3e-9 for ‖A‖ up to entry n − 2: (3e-9 (n + 1)!)^(1/(n + 1)).
/// This error must be smaller than rounding errors: it is the same in every step, and they are not.
constexpr float series_reach[] = {0.00262f, 0.0164f, 0.0514f, 0.1137f, 0.205f,
                                  0.3238f,  0.4688f, 0.6364f, 0.8246f, 1.03f};
constexpr int max_terms = 11;

constexpr int packet_rays = 32;  // Number of rays in a packet: several vectors.
using PerRay = float[packet_rays];

/// Where rays are. Only those with differentials have derivatives of p and v along two parameters.
struct alignas(64) RayState {
  PerRay p[3];  // Position, in voxels from the first voxel of the packet's brick.
  PerRay v[3];  // V; unit, world axes.
  PerRay u[3];  // The direction in index space: the change of p per world unit.
  PerRay dp[2][3], dv[2][3];
};

/// Rays side by side, one in each lane. All lanes of its vectors hold a ray, so that no step needs a mask: a lane whose
/// ray has ended repeats another ray.
///
/// Positions are in voxels of level 0, from the first voxel of a brick of level 0, whatever the leaf is in which a ray
/// was sampled last.
struct alignas(64) Packet {
  RayState now, next;      // Before and after the step that is being taken.
  PerRay kick;             // σ.
  PerRay length;           // Length of the path since the ray entered the packet, world units.
  PerRay wanted;           // The next step, voxels of level 0, before it is limited by the leaf.
  PerRay reach;            // Upper bound of ‖σ h T‖ in the leaf.
  PerRay strongest;        // TensorBrick::strongest of the leaf.
  PerRay low[3], high[3];  // Box of the voxels, relative to the brick.
  PerRay last[3];          // Last cell, relative to the brick.
  PerRay leaf_low[3], leaf_high[3], leaf_last[3];  // The same as seen from the leaf; only if the field has levels.
  PerRay log_radiance_scale;  // Λ since the ray entered the packet; not of rays with differentials.
  PerRay first[3], scale;     // LeafBrick::first and scale; before find_bricks, the point whose leaf is wanted.

  // The step that is being taken:
  PerRay time;            // Its length, world units.
  PerRay sample[3];       // Positions of the samples.
  PerRay voxel;           // Number, in the leaf, of the first coefficient that the sample needs.
  PerRay fraction[3];     // Position within the cell.
  PerRay tensor[8];       // Stored components of the tensors (see TensorBrick), component after component.
  PerRay change_of_step;  // Λ of this step.
  PerRay excess;          // Of adaptive steps: the error divided by the tolerance.
  PerRay finest;          // The greatest scale of a leaf that was sampled; only if the field has levels.
  PerRay slopes[3][8];    // Of the tensors along x, y and z, per voxel of the leaf; only for rays with differentials.

  const float* bending[packet_rays] = {};  // Of the leaves.
  alignas(64) std::int32_t brick[3][packet_rays];
  std::int32_t ray[packet_rays];
  std::uint32_t alive = 0;  // One bit for each lane.
  std::uint32_t lands = 0;  // The lanes whose step meets a surface, or a face of the extent.
  int vectors = 0;          // Number of vectors in use.
  std::uint32_t steps = 0, step_limit = 0;
  float max_reach = 0;
  bool near_surface = false;
  bool straight = false;  // Whether a lane's leaf bends nothing.
  bool refined = false;   // Whether a lane's leaf is finer than level 0.

  Packet() { std::fill_n(scale, packet_rays, 1.0f); }
};

/// A kick that is too strong for a series in single precision: its direction, zero if there is none, and its Λ.
struct StrongKick {
  float direction[3], log_radiance_scale;
};

/// @param T  T − T₂₂ I, column by column. @param factor  σ h.
StrongKick strong_kick(const float T[9], float factor, const float v[3]);

/// Those of some lanes whose steps may meet a surface, as bits: all that do, and few others.
std::uint32_t near_surfaces(const PacketMedium& medium, const Packet& packet, std::uint32_t which);

/// Whether the step of a lane, from `now` to `next`, meets a surface before it leaves the extent; sets `landing`.
/// @param leaves  Whether `next` is outside the extent.
bool step_meets_surface(const PacketMedium& medium, const Packet& packet, int lane, bool leaves,
                        SurfaceLanding& landing);

/// Records points between the ends of a lane's step, which may be long.
void add_inner_points(const PacketMedium& medium, const Packet& packet, int lane, std::vector<StepPoint>& points);

}  // namespace tensorray::packets
