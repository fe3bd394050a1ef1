#pragma once
/// @file tools/benchmark/machine.h
/// What the machine is and can do at most: the bounds that kernels are held against.

#include <cstddef>
#include <string>
#include <vector>

namespace tensorray::benchmark {

struct Processor {
  std::string model, compiler;
  int threads = 1;  ///< That a program may use.
};

/// Of one set of vector instructions.
struct VectorRate {
  std::string instructions;
  int lanes = 0;             ///< Floats a vector.
  double multiply_adds = 0;  ///< Vectors a second, one thread, from independent chains. Where there is no fused
                             ///< instruction (before AVX2) a multiplication and an addition.
};

/// Bytes a second; arrays are far larger than caches.
struct Bandwidth {
  double read = 0;   ///< A sum.
  double triad = 0;  ///< a = b + 3 c, three arrays counted.
};

Processor processor();

/// The widest first. @param seconds  That each repetition takes; the median of five counts.
std::vector<VectorRate> vector_rates(double seconds);

Bandwidth bandwidth(int threads, std::size_t array_bytes);

}  // namespace tensorray::benchmark
