#pragma once
/// @file tools/benchmark/kernels/kernels.h
/// The kernels that are compared: those of tensorray, and the alternatives in other libraries.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/benchmark/kernels/workload.h"

namespace tensorray::benchmark {

/// Follows the rays of a batch until they leave the field's bounds, as `tensorray::trace` does. Sets positions and
/// directions, and adds to `tensor_samples`. Only one thread at a time may call it.
using TraceFunction = std::function<void(RayBatch&)>;

struct Kernel {
  std::string name;
  /// Converts the field to what the kernel samples. The field must outlive the returned function.
  std::function<TraceFunction(const TestField&)> make;
  std::string instructions;                ///< Instruction set of tensorray's packet kernel; empty for other kernels.
  std::string missing;                     ///< Why the kernel cannot be measured here; empty if it can.
  bool follows_the_rule = true;            ///< Whether it traces rays by Eq. 5, so that they end at the same positions.
  bool on_one_field = false;               ///< Whether it is measured on the first field only.
  BendingSettings settings = splitting();  ///< Settings of the reference that it is compared with.

  static BendingSettings splitting() {
    BendingSettings settings;
    settings.step = step;
    return settings;
  }
};

/// All kernels. Ratios are relative to the first one.
std::vector<Kernel> all_kernels();

Kernel openvdb_rows_kernel();    ///< Three Vec3S grids, BoxSampler, value accessors.
Kernel openvdb_matrix_kernel();  ///< One grid of Mat3s, BoxSampler, value accessor.
Kernel nanovdb_rows_kernel();    ///< Three Vec3f grids, trilinear sampler, read accessors.
std::vector<Kernel> vtk_kernels();
std::vector<Kernel> tensorray_kernels();

}  // namespace tensorray::benchmark
