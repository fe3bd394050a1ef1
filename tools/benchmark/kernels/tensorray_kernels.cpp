#include <memory>

#include "integrators/kernels/packet_kernel.h"
#include "integrators/tracing/trace.h"
#include "tools/benchmark/kernels/kernels.h"

namespace tensorray::benchmark {
namespace {

TraceFunction reference_tracer(const TestField& test) {
  return [&test](RayBatch& batch) { trace_reference(test.field, test.geometry, Kernel::splitting(), batch); };
}

std::function<TraceFunction(const TestField&)> packet_tracer(const BendingSettings& settings) {
  return [=](const TestField& test) {
    return [&test, settings](RayBatch& batch) { trace(test.field, test.geometry, settings, batch); };
  };
}

/// Another method, with the best instructions of the processor and automatic steps.
Kernel other_method(const std::string& name, BendingMethod method) {
  Kernel kernel;
  kernel.name = "tensorray, packets, " + name;
  kernel.on_one_field = true;
  kernel.settings.method = method;
  kernel.settings.step = 0;
  kernel.make = packet_tracer(kernel.settings);
  return kernel;
}

/// The same voxels with cubic interpolation, with the best instructions of the processor.
Kernel cubic_kernel(const std::string& name, BendingMethod method, double step_length) {
  Kernel kernel;
  kernel.name = "tensorray, packets, cubic, " + name;
  kernel.follows_the_rule = false;  // Rays end beside those of the linear reference.
  BendingSettings settings;
  settings.method = method;
  settings.step = step_length;
  kernel.make = [settings](const TestField& test) -> TraceFunction {
    const auto field = std::make_shared<TensorField>(test.grid, Interpolant{Interpolation::cubic, Border::fade});
    return [field, settings, &test](RayBatch& batch) { trace(*field, test.geometry, settings, batch); };
  };
  return kernel;
}

}  // namespace

std::vector<Kernel> tensorray_kernels() {
  Kernel reference;
  reference.name = "tensorray, scalar reference";
  reference.make = reference_tracer;
  std::vector<Kernel> kernels{reference};
  for (const std::string& instructions : packets::instruction_sets()) {
    Kernel kernel;
    kernel.name = "tensorray, packets, " + instructions;
    kernel.instructions = instructions;
    kernel.make = packet_tracer(kernel.settings);
    kernels.push_back(kernel);
  }
  kernels.push_back(cubic_kernel("splitting", BendingMethod::splitting, step));
  kernels.push_back(cubic_kernel("splitting4", BendingMethod::splitting4, 0));
  kernels.push_back(other_method("euler", BendingMethod::euler));
  kernels.push_back(other_method("rk4", BendingMethod::rk4));
  kernels.push_back(other_method("bs23", BendingMethod::bs23));
  kernels.push_back(other_method("dopri5", BendingMethod::dopri5));
  return kernels;
}

std::vector<Kernel> all_kernels() {
  std::vector<Kernel> kernels{openvdb_rows_kernel(), openvdb_matrix_kernel(), nanovdb_rows_kernel()};
  for (Kernel& kernel : vtk_kernels()) kernels.push_back(std::move(kernel));
  for (Kernel& kernel : tensorray_kernels()) kernels.push_back(std::move(kernel));
  return kernels;
}

}  // namespace tensorray::benchmark
