/// @file integrators/kernels/packet_targets.h
/// The instruction sets for which the kernel is compiled. Included by sources that define HWY_TARGET_INCLUDE.

#include <hwy/foreach_target.h>  // IWYU pragma: keep

/// The function for the instruction set that is selected. It must be exported (HWY_EXPORT).
#ifndef KERNEL_DISPATCH
#if HWY_TARGETS & HWY_AVX2
#define KERNEL_DISPATCH(function) (prefers_avx2 ? &N_AVX2::function : &HWY_DYNAMIC_DISPATCH(function))
#else
#define KERNEL_DISPATCH(function) HWY_DYNAMIC_DISPATCH(function)
#endif
#endif
