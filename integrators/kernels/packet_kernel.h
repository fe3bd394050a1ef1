#pragma once
/// @file integrators/kernels/packet_kernel.h
/// Traces many rays at once inside a field. Steps are those of scalar_tracer.h, in single precision and in the widest
/// vectors of the processor. docs/dev/performance_notes.md explains the method.

#include <cstdint>
#include <string>
#include <vector>

#include "integrators/packets/kernel_rays.h"
#include "integrators/packets/packet_medium.h"

namespace tensorray::packets {

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

// Between the sources of the kernel:

/// `run` in a cubic field.
std::uint64_t trace_cubic(const PacketMedium& medium, KernelRays& batch);

/// Whether the kernel does not use vectors wider than AVX2's.
extern bool prefers_avx2;

}  // namespace tensorray::packets
