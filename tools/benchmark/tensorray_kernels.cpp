#include "tools/benchmark/kernels.h"

namespace tensorray::benchmark {
namespace {

BendingSettings settings() {
  BendingSettings settings;
  settings.step = step;
  return settings;
}

TraceFunction reference_tracer(const TestField& test) {
  return [&test](RayBatch& batch) { trace(test.field, test.geometry, settings(), batch); };
}

}  // namespace

std::vector<Kernel> tensorray_kernels() {
  Kernel reference;
  reference.name = "tensorray, scalar reference, double";
  reference.make = reference_tracer;
  return {reference};
}

}  // namespace tensorray::benchmark
