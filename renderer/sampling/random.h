#pragma once
/// Random and low-discrepancy numbers as pure functions of (seed, index, dimension), so that a picture does not depend
/// on the number of threads. There is no state: any thread may call every function.

#include <array>
#include <cstdint>

namespace tensorray {

/// A hashed uniform number in [0, 1) with 53 random bits.
double random_uniform(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension);

/// What `random_uniform` makes of its first two keys: random_uniform(seed, index, d) = random_uniform(key, d).
std::uint64_t random_key(std::uint64_t seed, std::uint64_t index);
double random_uniform(std::uint64_t key, std::uint32_t dimension);

/// Point `index` of the Sobol sequence, shuffled and Owen-scrambled by `seed` (Burley 2020, "Practical Hash-based Owen
/// Scrambling"). The first 2^32 points are distinct. The shuffle maps each aligned block of 2^k indices to another such
/// block. Therefore the first 2^k points have one point in each elementary interval (each box 2^-i by 2^-j, i + j = k)
/// of dimensions (0, 1). In all three dimensions, boxes of volume 2^(1-k) contain two points each. Others are an error.
/// @return a multiple of 2^-32 in [0, 1)
/// @throw std::invalid_argument if dimension > 2.
double sobol(std::uint64_t seed, std::uint32_t index, std::uint32_t dimension);

/// Dimensions 0 and 1 of `sobol`, in two thirds of the time.
std::array<double, 2> sobol_pair(std::uint64_t seed, std::uint32_t index);

/// Two points that the same point of a sequence gives, scrambled apart. Each of them is as stratified as the sequence;
/// for one function of the first and one of the second, the errors of their means are uncorrelated.
struct SobolTwins {
  std::array<double, 2> first, second;
};

/// The first four dimensions of the Sobol sequence, Owen-scrambled by `key` but not shuffled, so that they are
/// stratified together: the first 2^k points of `joint_sobol_start`, with either of the twins, have four points in each
/// elementary interval of volume 2^(2-k) up to k = 7, and eight in each of volume 2^(3-k) up to k = 10.
/// `joint_sobol_start` has dimensions 0 and 1, with one point in each of their elementary intervals;
/// `joint_sobol_twins` has dimensions 2 and 3, twice. Keys of the two, and of `sobol_twins`, must be three apart.
std::array<double, 2> joint_sobol_start(std::uint64_t key, std::uint32_t index);
SobolTwins joint_sobol_twins(std::uint64_t key, std::uint32_t index);

/// Dimensions 0 and 1 of `sobol` for one shuffle by `key`, twice: in half the time of two pairs.
SobolTwins sobol_twins(std::uint64_t key, std::uint32_t index);

}  // namespace tensorray
