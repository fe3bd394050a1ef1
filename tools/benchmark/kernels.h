#pragma once
/// @file tools/benchmark/kernels.h
/// The kernels that are compared: this program's, and what one would pick instead.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/benchmark/workload.h"

namespace tensorray::benchmark {

/// Follows a batch's rays until they leave the field's bounds, as `tensorray::trace` does; sets positions and
/// directions, adds to `tensor_samples`. One thread at a time.
using TraceFunction = std::function<void(RayBatch&)>;

struct Kernel {
  std::string name;
  /// Makes what the kernel samples of the field, which must outlive the function.
  std::function<TraceFunction(const TestField&)> make;
  std::string instructions;                ///< Of this program's packet kernel; empty for the others.
  std::string missing;                     ///< Why it cannot be measured here; empty if it can.
  bool follows_the_rule = true;            ///< Whether its rays are those of Eq. 5, with the same ends.
  bool on_one_field = false;               ///< Measured on the first only.
  BendingSettings settings = splitting();  ///< Of the reference that its ends are compared with.

  static BendingSettings splitting() {
    BendingSettings settings;
    settings.step = step;
    return settings;
  }
};

/// The first is what ratios are taken to.
std::vector<Kernel> all_kernels();

Kernel openvdb_rows_kernel();    ///< Three Vec3S grids, BoxSampler, value accessors.
Kernel openvdb_matrix_kernel();  ///< One grid of Mat3s, BoxSampler, value accessor.
Kernel nanovdb_rows_kernel();    ///< Three Vec3f grids, trilinear sampler, read accessors.
std::vector<Kernel> vtk_kernels();
std::vector<Kernel> tensorray_kernels();

}  // namespace tensorray::benchmark
