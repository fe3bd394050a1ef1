#pragma once
/// Traces many rays at once inside a cubic field, by `splitting4`: the default. (The same code has `splitting` with
/// steps of a given length, which the search of the automatic scale uses.) Steps are those of scalar_tracer.h, in
/// single precision and in the widest vectors of the processor. docs/dev/performance_notes.md explains the method. The
/// code for vectors is in the headers *-inl.h, which packet_kernel.cpp includes once for each instruction set: a step
/// is in packet_step-inl.h, the tensor at a point in packet_splines-inl.h.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray::packets {

/// A ray in the field.
struct KernelRay {
  BrickPoint place;
  std::array<float, 3> direction;  ///< V; unit, world axes.
  float strength = 0;              ///< σ = s · scale.
  float norm = 0;                  ///< Norm of the deviator of T at the start; 0 if it does not make steps shorter.
  double length = 0;               ///< Length of the path, world units; the kernel adds to it.
  std::uint32_t steps = 0;         ///< Number of steps; the kernel adds to it.
  float log_radiance_scale = 0;    ///< Λ in the kernel; not of rays with differentials.
  std::int8_t axis = -1;           ///< Axis of the face of the extent where the ray left; -1: it has not left.
                                   ///< `on_surface`: it is on a surface.
  float step = 0;                  ///< If the ray has not left: length of its next step, world units.
  bool lands = false;              ///< Whether this step meets a surface. Without it, the step would end at
  std::array<float, 3> end{}, end_direction{};  ///< a position as that of `place`, with this direction.
};

/// Derivatives of a ray along two parameters: voxels, in index space, and radians.
struct KernelDifferential {
  float position[2][3], direction[2][3];
};

constexpr std::int8_t on_surface = 3;

/// Where a step of a ray meets a surface first.
struct SurfaceLanding {
  Hit hit;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< Of the surface; world.
  std::array<float, 3> normal{};                    ///< Of the surface in index space, any length,
  float to_plane = 0;  ///< the way along it from the beginning of the step to the surface, and
  float part = 0;      ///< about how much of the step is taken until then. 0: it meets nothing.
};

struct KernelRays {
  std::vector<KernelRay> rays;
  std::vector<SurfaceLanding> landings;           ///< One for every ray if there are surfaces, set by the kernel.
  std::vector<KernelDifferential> differentials;  ///< One for every ray, or empty.
  std::vector<std::vector<StepPoint>*> points;    ///< One list for every ray, to which the kernel adds; or empty.
};

struct KernelSettings {
  bool is_splitting = false;  ///< Whether the method is `splitting`, whose `step` must be given.
  float step = 0;             ///< Voxels; 0: automatic.
  float tolerance = 0;        ///< Of automatic steps, voxels.
  std::uint32_t max_steps = 0;
  float max_length = 0;                ///< World units; limit of the whole path, `KernelRay::length` included.
  const Geometry* geometry = nullptr;  ///< Its surfaces end steps. Null: none in the field.
  Eigen::AlignedBox3d surfaces;        ///< Box around these surfaces, index space.
};

/// Traces every ray to the face of the extent where it leaves, or to a surface (then `axis` is set and the ray is
/// there), or to the point before a step that the kernel does not take. These are steps beyond the greatest length or
/// number of steps, those that leave the extent between their ends or across its edges, and where σ·T cannot be
/// followed; for rays with differentials, also all steps onto a surface or out of the extent. The result of a ray
/// depends on that ray alone, not on its neighbours. Tracing is fastest if rays of one origin, or of neighbouring
/// origins, stand next to each other.
/// @param field  Cubic.
/// @return the number of tensor samples.
std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch);

/// Names of the processor's vector instruction sets for which the kernel is compiled, the widest first. The widest is
/// used, unless a narrower one is faster.
std::vector<std::string> instruction_sets();

/// Selects one of `instruction_sets()`; empty: the fastest. For tests and benchmarks.
/// Threads: do not call it while rays are traced.
void use_instruction_set(const std::string& name);

/// Number of lanes of a vector with the selected instruction set. 1: the processor has no vectors that Highway knows,
/// and `run` must not be called.
int lane_count();

}  // namespace tensorray::packets
