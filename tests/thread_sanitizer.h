#pragma once
/// @file tests/thread_sanitizer.h
/// Whether tests run under the thread sanitizer, which has four bytes of its own for each byte of a program.

namespace tensorray::test {

#ifdef __has_feature  // Clang, which the preset `tsan` uses.
#if __has_feature(thread_sanitizer)
#define TENSORRAY_THREAD_SANITIZER
#endif
#endif

#ifdef TENSORRAY_THREAD_SANITIZER
inline constexpr bool has_thread_sanitizer = true;
#else
inline constexpr bool has_thread_sanitizer = false;
#endif

}  // namespace tensorray::test
