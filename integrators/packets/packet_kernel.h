#pragma once
/// @file integrators/packets/packet_kernel.h
/// Many rays at once through the inside of a field: the same steps as those of scalar_tracer.h, in single precision and
/// in the processor's widest vectors. A part of packet_tracer.cpp. docs/performance.md explains it.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "integrators/bending/bending.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray::packets {

/// A ray in the field. Positions are relative to a brick, so that single precision resolves 1e-6 of a voxel however
/// large the field is.
struct KernelRay {
  std::array<std::int32_t, 3> brick;  ///< In units of bricks.
  std::array<float, 3> position;      ///< From the brick's first voxel, in voxels.
  std::array<float, 3> direction;     ///< V; unit, world axes.
  float strength = 0;                 ///< σ = s · scale.
  float norm = 0;                     ///< Of the deviator of T as last sampled; 0 where that asks for no shorter step.
  double length = 0;                  ///< Of the way, world units; added to.
  std::uint32_t steps = 0;            ///< Added to.
  std::int8_t axis = -1;              ///< Of the face of the extent where it left; -1: it has not.
  float step = 0;                     ///< If it has not left: of its next step, world units; 0: not known.
};

/// How a ray changes with two parameters: voxels, in index space, and radians.
struct KernelDifferential {
  float position[2][3], direction[2][3];
};

/// A ray after a step.
struct KernelPoint {
  std::array<std::int32_t, 3> brick;
  std::array<float, 3> position, direction;
  double length;  ///< Of the way, world units.
};

struct KernelRays {
  std::vector<KernelRay> rays;
  std::vector<KernelDifferential> differentials;  ///< One for every ray, or none.
  std::vector<std::vector<KernelPoint>> points;   ///< One list for every ray, added to; or none.
};

/// Why a ray cannot go on by packets: asked where surfaces are near.
using MeetsSurface = std::function<bool(const Eigen::Vector3d& from, const Eigen::Vector3d& to)>;

struct KernelSettings {
  BendingMethod method = BendingMethod::splitting;
  float step = 0;       ///< Voxels; 0: automatic.
  float tolerance = 0;  ///< Adaptive methods: voxels and radians.
  std::uint32_t max_steps = 0;
  float max_length = 0;          ///< World units; of the whole way, `KernelRay::length` included.
  MeetsSurface meets_surface;    ///< Null if there are no surfaces within the field.
  Eigen::AlignedBox3d surfaces;  ///< Where they are, index space.
};

/// Takes every ray to the face of the extent where it leaves (`axis` is set, and it is on that face), or to the point
/// before a step that the kernel does not take: onto a surface, past the greatest length or number of steps, where σ·T
/// cannot be followed, and, of rays with differentials, out of the extent. A ray's result depends on that ray alone,
/// not on its neighbours; rays are fastest if those of one origin, or of neighbouring ones, stand next to each other.
/// @return the number of tensor samples.
std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch);

/// Vector instructions of the processor that the kernel is compiled for, best first, by name; the first is used.
std::vector<std::string> instruction_sets();

/// From now on only this one of `instruction_sets()` is used; empty: the best. For tests and benchmarks.
/// Threads: not while rays are traced.
void use_instruction_set(const std::string& name);

/// Lanes of a vector with the instruction set in use.
int lane_count();

/// Arithmetic vector operations of one step of a vector of rays in one cell, where the field is weak: what bounds its
/// speed. To the middle, its cell and the corners' weights 29, the tensor 64, the kick and on to the end 37.
constexpr int operations_per_step = 130;

}  // namespace tensorray::packets
