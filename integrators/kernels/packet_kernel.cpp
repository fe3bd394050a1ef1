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

/// More kernels would be a little faster, but take longer to compile. Most fields have voxels that are cubes along the
/// axes; where others do, and where there are no vectors, one kernel always computes the change of radiance.
template <class Bricks>
std::uint64_t trace_components(const PacketMedium& medium, KernelRays& batch) {
  constexpr bool has_vectors = HWY_TARGET != HWY_SCALAR;
  const bool differentials = !batch.differentials.empty();
  if constexpr (has_vectors) {
    if (medium.uniform && differentials) return Kernel<Bricks, true, true, false>(medium, batch).run();
    if (medium.uniform)
      return batch.wants_log_radiance_scale ? Kernel<Bricks, true, false, true>(medium, batch).run()
                                            : Kernel<Bricks, true, false, false>(medium, batch).run();
  }
  return differentials ? Kernel<Bricks, false, true, false>(medium, batch).run()
                       : Kernel<Bricks, false, false, true>(medium, batch).run();
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

int lane_count() { return KERNEL_DISPATCH(vector_lanes)(); }

std::uint64_t run(const TensorField& field, const KernelSettings& settings, KernelRays& batch) {
  PacketMedium medium(field, settings);
  medium.uniform &= lane_count() > 1;
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

}  // namespace tensorray::packets
#endif
