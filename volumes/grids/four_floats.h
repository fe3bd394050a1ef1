#pragma once
/// @file volumes/grids/four_floats.h
/// Vectors of four numbers, which all processors have.

#include <cstdint>
#include <cstring>

namespace tensorray {

using Four = float __attribute__((vector_size(16)));
using FourBits = std::uint32_t __attribute__((vector_size(16)));

inline Four read_four(const float* from) {
  Four vector;
  std::memcpy(&vector, from, sizeof vector);
  return vector;
}

inline void write_four(const Four& vector, float* to) { std::memcpy(to, &vector, sizeof vector); }

/// The numbers whose bits are in `mask`; zeros for the others.
inline Four kept(const Four& x, const FourBits& mask) {
  return reinterpret_cast<Four>(reinterpret_cast<FourBits>(x) & mask);
}

/// Zero where numbers are the same, bit for bit.
inline FourBits difference(const Four& a, const Four& b) {
  return reinterpret_cast<FourBits>(a) ^ reinterpret_cast<FourBits>(b);
}

/// a₀ b₀ a₁ b₁, a₂ b₂ a₃ b₃, a₀ a₁ b₀ b₁, a₂ a₃ b₂ b₃.
inline Four low_pairs(const Four& a, const Four& b) { return __builtin_shufflevector(a, b, 0, 4, 1, 5); }
inline Four high_pairs(const Four& a, const Four& b) { return __builtin_shufflevector(a, b, 2, 6, 3, 7); }
inline Four low_halves(const Four& a, const Four& b) { return __builtin_shufflevector(a, b, 0, 1, 4, 5); }
inline Four high_halves(const Four& a, const Four& b) { return __builtin_shufflevector(a, b, 2, 3, 6, 7); }

}  // namespace tensorray
