// The kernel for cubic fields. It is apart because it takes as long to compile as that for linear ones.

#include "integrators/kernels/packet_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/kernels/packet_kernel_cubic.cpp"  // NOLINT
#include "integrators/kernels/packet_targets.h"
// Must come after packet_targets.h:
#include <hwy/highway.h>

#include "integrators/kernels/packet_kernel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

/// Beside a cubic's samples it costs little to treat all voxels alike, and to compute changes of radiance always.
template <int components>
std::uint64_t trace_splines(const PacketMedium& medium, KernelRays& batch) {
  using Bricks = CubicBricks<components>;
  return batch.differentials.empty() ? Kernel<Bricks, false, false, true>(medium, batch).run()
                                     : Kernel<Bricks, false, true, false>(medium, batch).run();
}

std::uint64_t trace_cubic_field(const PacketMedium& medium, KernelRays& batch) {
  return medium.field.is_symmetric() ? trace_splines<TensorBrick::symmetric>(medium, batch)
                                     : trace_splines<TensorBrick::general>(medium, batch);
}

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray::packets {

HWY_EXPORT(trace_cubic_field);

std::uint64_t trace_cubic(const PacketMedium& medium, KernelRays& batch) {
  return KERNEL_DISPATCH(trace_cubic_field)(medium, batch);
}

}  // namespace tensorray::packets
#endif
