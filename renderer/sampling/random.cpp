#include "renderer/sampling/random.h"

#include <array>
#include <stdexcept>
#include <string>

namespace tensorray {
namespace {

constexpr int sobol_dimensions = 3;
constexpr int sobol_bits = 32;

using DirectionNumbers = std::array<std::array<std::uint32_t, sobol_bits>, sobol_dimensions>;

/// The direction numbers of Joe and Kuo 2008, highest bit first. Dimension 0 is the van der Corput sequence. Dimensions
/// 1 and 2 follow the recurrences of the primitive polynomials x + 1 (first number 1) and x² + x + 1 (first numbers 1,
/// 3).
constexpr DirectionNumbers make_direction_numbers() {
  DirectionNumbers v{};
  for (int i = 0; i < sobol_bits; ++i) v[0][i] = 0x80000000u >> i;
  v[1][0] = 0x80000000u;
  for (int i = 1; i < sobol_bits; ++i) v[1][i] = v[1][i - 1] ^ (v[1][i - 1] >> 1);
  v[2][0] = 0x80000000u;
  v[2][1] = 3u << 30;
  for (int i = 2; i < sobol_bits; ++i) v[2][i] = v[2][i - 1] ^ v[2][i - 2] ^ (v[2][i - 2] >> 2);
  return v;
}

constexpr DirectionNumbers direction_numbers = make_direction_numbers();

/// The finalizer of SplitMix64 (Steele, Lea and Flood 2014; constants of Stafford's variant 13): a bijection in which
/// every bit of the argument changes every bit of the result with probability about ½.
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Mixes after each key, so that different keys with equal sums give different results.
constexpr std::uint64_t hash(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension) {
  return mix(mix(mix(seed) + index) + dimension);
}

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/// Owen's nested uniform scrambling: each bit is flipped or not, at random, depending on the bits above it. On reversed
/// bits this is a hash in which bits only affect higher bits (Laine and Karras 2011, with Vegdahl's constants of 2021).
constexpr std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  x = reverse_bits(x);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

}  // namespace

double random_uniform(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension) {
  return static_cast<double>(hash(seed, index, dimension) >> 11) * 0x1p-53;
}

double sobol(std::uint64_t seed, std::uint32_t index, std::uint32_t dimension) {
  if (dimension >= sobol_dimensions)
    throw std::invalid_argument("the Sobol sequence has dimensions 0 to 2 here, not " + std::to_string(dimension));
  const auto key = [seed](std::uint32_t use) { return static_cast<std::uint32_t>(hash(seed, 0, use) >> 32); };
  const std::uint32_t shuffled = owen_scramble(index, key(sobol_dimensions));
  std::uint32_t x = 0;
  for (int bit = 0; bit < sobol_bits; ++bit) x ^= direction_numbers[dimension][bit] & (0u - ((shuffled >> bit) & 1u));
  return owen_scramble(x, key(dimension)) * 0x1p-32;
}

}  // namespace tensorray
