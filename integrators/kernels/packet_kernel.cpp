#include "integrators/kernels/packet_kernel.h"

#include <algorithm>
#include <stdexcept>

// The code below is compiled once for each instruction set. The best one of the processor is selected at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/kernels/packet_kernel.cpp"  // NOLINT
#include "integrators/kernels/packet_targets.h"
// Must come after packet_targets.h:
#include <hwy/highway.h>

#include "integrators/kernels/packet_kernel-inl.h"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

HWY_BEFORE_NAMESPACE();
namespace tensorray::packets::HWY_NAMESPACE {

template <class Bricks, bool differentials, bool changes>
std::uint64_t trace_as(const PacketMedium& medium, KernelRays& batch) {
  return medium.uniform ? Kernel<Bricks, true, differentials, changes>(medium, batch).run()
                        : Kernel<Bricks, false, differentials, changes>(medium, batch).run();
}

template <class Bricks>
std::uint64_t trace_components(const PacketMedium& medium, KernelRays& batch) {
  if (!batch.differentials.empty()) return trace_as<Bricks, true, false>(medium, batch);
  return batch.wants_log_radiance_scale ? trace_as<Bricks, false, true>(medium, batch)
                                        : trace_as<Bricks, false, false>(medium, batch);
}

std::uint64_t trace(const PacketMedium& medium, KernelRays& batch) {
  return medium.field.is_symmetric() ? trace_components<LinearBricks<TensorBrick::symmetric>>(medium, batch)
                                     : trace_components<LinearBricks<TensorBrick::general>>(medium, batch);
}

int vector_lanes() { return lanes; }

}  // namespace tensorray::packets::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray::packets {

HWY_EXPORT(trace);
HWY_EXPORT(vector_lanes);

namespace {

bool is_zen4() {
#if defined(__x86_64__) && defined(__GNUC__)
  __builtin_cpu_init();
  return __builtin_cpu_is("amd") && __builtin_cpu_supports("avx512f") &&
         !__builtin_cpu_supports("avx512vp2intersect");  // Zen 5 has it.
#else
  return false;
#endif
}

}  // namespace

/// Zen 4 does the operations of AVX-512 in two halves: the kernel, of all code with vectors, is faster with AVX2 there.
bool prefers_avx2 = is_zen4();

namespace {

#if defined(__SSE__)
/// Denormal numbers count as zero during the lifetime of this object, because arithmetic with them is many times
/// slower.
class WithoutDenormals {
 public:
  WithoutDenormals() { _mm_setcsr(before_ | 0x8040); }
  ~WithoutDenormals() { _mm_setcsr(before_); }
  WithoutDenormals(const WithoutDenormals&) = delete;
  WithoutDenormals& operator=(const WithoutDenormals&) = delete;

 private:
  const unsigned before_ = _mm_getcsr();
};
#else
struct WithoutDenormals {};
#endif

}  // namespace

std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch) {
  const PacketMedium medium(field, settings);
  [[maybe_unused]] const WithoutDenormals guard;
  return field.is_cubic() ? trace_cubic(medium, batch) : KERNEL_DISPATCH(trace)(medium, batch);
}

namespace {

/// The processor's instruction sets.
const std::vector<std::int64_t>& targets() {
  static const std::vector<std::int64_t> all = hwy::SupportedAndGeneratedTargets();
  return all;
}

}  // namespace

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const std::int64_t target : targets()) names.push_back(hwy::TargetName(target));
  return names;
}

void use_instruction_set(const std::string& name) {
  const auto found = std::find_if(targets().begin(), targets().end(),
                                  [&](std::int64_t target) { return name == hwy::TargetName(target); });
  if (found == targets().end() && !name.empty())
    throw std::invalid_argument("this processor has no instruction set \"" + name + "\"");
  prefers_avx2 = name.empty() && is_zen4();
  hwy::SetSupportedTargetsForTest(name.empty() ? 0 : *found);
}

int lane_count() { return KERNEL_DISPATCH(vector_lanes)(); }

}  // namespace tensorray::packets
#endif
