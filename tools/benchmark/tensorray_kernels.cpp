#include "integrators/packet_kernel.h"
#include "tools/benchmark/kernels.h"

namespace tensorray::benchmark {
namespace {

BendingSettings settings() {
  BendingSettings settings;
  settings.step = step;
  return settings;
}

TraceFunction reference_tracer(const TestField& test) {
  return [&test](RayBatch& batch) { trace_reference(test.field, test.geometry, settings(), batch); };
}

TraceFunction packet_tracer(const TestField& test) {
  return [&test](RayBatch& batch) { trace(test.field, test.geometry, settings(), batch); };
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
    kernel.make = packet_tracer;
    kernels.push_back(kernel);
  }
  return kernels;
}

}  // namespace tensorray::benchmark
