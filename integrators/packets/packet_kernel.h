#pragma once
/// @file integrators/packets/packet_kernel.h
/// Traces many rays at once inside a field. Steps are those of scalar_tracer.h, in single precision and in the widest
/// vectors of the processor. A part of packet_tracer.cpp. docs/dev/performance_notes.md explains the method.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "integrators/bending/bending.h"
#include "integrators/bending/ray_record.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray::packets {

/// A ray in the field.
struct KernelRay {
  BrickPoint place;
  std::array<float, 3> direction;  ///< V; unit, world axes.
  float strength = 0;              ///< σ = s · scale.
  float norm = 0;                  ///< Norm of the deviator of T as last sampled; 0 if it does not make steps shorter.
  double length = 0;               ///< Length of the path, world units; the kernel adds to it.
  std::uint32_t steps = 0;         ///< Number of steps; the kernel adds to it.
  float log_radiance_scale = 0;    ///< Λ in the kernel, if it is wanted.
  std::int8_t axis = -1;           ///< Axis of the face of the extent where the ray left; -1: it has not left.
  float step = 0;                  ///< If the ray has not left: length of its next step, world units; 0: not known.
};

/// Derivatives of a ray along two parameters: voxels, in index space, and radians.
struct KernelDifferential {
  float position[2][3], direction[2][3];
};

struct KernelRays {
  std::vector<KernelRay> rays;
  std::vector<KernelDifferential> differentials;  ///< One for every ray, or empty.
  std::vector<std::vector<StepPoint>*> points;    ///< One list for every ray, to which the kernel adds; or empty.
  bool wants_log_radiance_scale = false;          ///< Only without differentials: see RayBatch.
};

/// Whether the step from one point to another meets a surface, so that packets cannot take it. Called where surfaces
/// are near.
using MeetsSurface = std::function<bool(const Eigen::Vector3d& from, const Eigen::Vector3d& to)>;

struct KernelSettings {
  BendingMethod method = BendingMethod::splitting;
  float step = 0;       ///< Voxels; 0: automatic.
  float tolerance = 0;  ///< Adaptive methods: voxels and radians.
  std::uint32_t max_steps = 0;
  float max_length = 0;          ///< World units; limit of the whole path, `KernelRay::length` included.
  MeetsSurface meets_surface;    ///< Null if there are no surfaces within the field.
  Eigen::AlignedBox3d surfaces;  ///< Box around these surfaces, index space.
};

/// Traces every ray to the face of the extent where it leaves (then `axis` is set and the ray is on that face), or to
/// the point before a step that the kernel does not take. These are steps onto a surface, beyond the greatest length or
/// number of steps, and where σ·T cannot be followed; for rays with differentials, also steps out of the extent. The
/// kernel does not take steps of `splitting4` that leave the extent between their ends or across its edges, either. The
/// result of a ray depends on that ray alone, not on its neighbours. Tracing is fastest if rays of one origin, or of
/// neighbouring origins, stand next to each other.
/// @return the number of tensor samples.
std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch);

/// Names of the processor's vector instruction sets for which the kernel is compiled, the widest first. The widest is
/// used, unless a narrower one is faster.
std::vector<std::string> instruction_sets();

/// Selects one of `instruction_sets()`; empty: the fastest. For tests and benchmarks.
/// Threads: do not call it while rays are traced.
void use_instruction_set(const std::string& name);

/// Number of lanes of a vector with the selected instruction set.
int lane_count();

/// Vector operations in one step of a vector of rays in one cell, where the field is weak. They limit the speed.
/// Multiplications and multiply-adds: middle and cell 6, kick and second half of the step 36, and 7 for each component
/// that voxels store.
constexpr int multiply_adds_per_step(int components) { return 6 + 36 + 7 * components; }
/// Additions, roundings, comparisons: middle and cell 10, length 1, and 3 for each component.
constexpr int adds_per_step(int components) { return 10 + 1 + 3 * components; }

}  // namespace tensorray::packets
