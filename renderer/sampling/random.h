#pragma once
/// @file renderer/sampling/random.h
/// Random and low-discrepancy numbers as pure functions of (seed, index, dimension), so that a picture does not depend
/// on the number of threads. There is no state: any thread may call every function.

#include <array>
#include <cstdint>

namespace tensorray {

/// A hashed uniform number in [0, 1) with 53 random bits.
double random_uniform(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension);

/// Point `index` of the Sobol sequence, shuffled and Owen-scrambled by `seed` (Burley 2020, "Practical Hash-based Owen
/// Scrambling"). The first 2^32 points are distinct. The shuffle maps each aligned block of 2^k indices to another such
/// block. Therefore the first 2^k points have one point in each elementary interval (each box 2^-i by 2^-j, i + j = k)
/// of dimensions (0, 1). In all three dimensions, boxes of volume 2^(1-k) contain two points each; no binary sequence
/// does better in three dimensions. Higher dimensions are an error.
/// @return a multiple of 2^-32 in [0, 1)
/// @throw std::invalid_argument if dimension > 2.
double sobol(std::uint64_t seed, std::uint32_t index, std::uint32_t dimension);

/// Dimensions 0 and 1 of `sobol`, in two thirds of the time.
std::array<double, 2> sobol_pair(std::uint64_t seed, std::uint32_t index);

}  // namespace tensorray
