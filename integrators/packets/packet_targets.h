/// @file integrators/packets/packet_targets.h
/// The instruction sets for which the kernel is compiled. Included by sources that define HWY_TARGET_INCLUDE.

// Structs of the kernel have vectors as members. That is not possible with vectors whose size is unknown at compile
// time.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#endif
#include <hwy/foreach_target.h>  // IWYU pragma: keep

/// The function for the instruction set that is selected. It must be exported (HWY_EXPORT).
#ifndef KERNEL_DISPATCH
#if HWY_TARGETS & HWY_AVX2
#define KERNEL_DISPATCH(function) (prefers_avx2 ? &N_AVX2::function : &HWY_DYNAMIC_DISPATCH(function))
#else
#define KERNEL_DISPATCH(function) HWY_DYNAMIC_DISPATCH(function)
#endif
#endif
