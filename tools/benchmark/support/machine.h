#pragma once
/// @file tools/benchmark/support/machine.h
/// Describes the machine and measures its limits, which kernels are compared with.

#include <cstddef>
#include <string>
#include <vector>

namespace tensorray::benchmark {

struct Processor {
  std::string model, compiler;
  int threads = 1;  ///< Number that a program may use.
};

/// The speed of one set of vector instructions.
struct VectorRate {
  std::string instructions;
  int lanes = 0;  ///< Floats per vector.
  // Operations of vectors per second, one thread, independent chains:
  double multiply_adds = 0;  ///< Without a fused instruction (before AVX2), a multiplication and an addition count as
                             ///< one.
  double adds = 0;
  double both = 0;  ///< As many multiply-adds as adds. Some processors add on pipes that do not multiply.
};

/// Memory bandwidth, bytes per second. The arrays are far larger than the caches.
struct Bandwidth {
  double read = 0;   ///< Sum of an array.
  double triad = 0;  ///< a = b + 3 c; the bytes of all three arrays count.
};

Processor processor();

/// Cycles per second: the highest rate of several repetitions of a chain of integer multiplications. On x86 each takes
/// three cycles.
/// @param seconds  Approximate length of a repetition.
double clock_rate(double seconds);

/// The rates of all instruction sets of the processor, the widest first. Rates are medians of five repetitions.
/// @param seconds  Approximate length of a repetition.
std::vector<VectorRate> vector_rates(double seconds);

Bandwidth bandwidth(int threads, std::size_t array_bytes);

}  // namespace tensorray::benchmark
