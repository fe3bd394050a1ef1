#include "renderer/sampling/random.h"

#include <stdexcept>
#include <string>

namespace tensorray {
namespace {

constexpr int sobol_dimensions = 3;

/// The finalizer of SplitMix64 (Steele, Lea and Flood 2014; constants of Stafford's variant 13): a bijection in which
/// every bit of the argument changes every bit of the result with probability about ½.
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/// Owen's nested uniform scrambling of a number whose bits are reversed: each bit is flipped or not, at random,
/// depending on the bits below it, which are above it in the number. A hash in which bits only affect higher bits does
/// that (Laine and Karras 2011, with Vegdahl's constants of 2021).
constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// The seeds of a sequence: of its shuffle, and of each of its dimensions.
class SequenceKeys {
 public:
  explicit constexpr SequenceKeys(std::uint64_t seed) : mixed_(mix(mix(seed))) {}

  constexpr std::uint32_t shuffle() const { return of_dimension(sobol_dimensions); }
  constexpr std::uint32_t of_dimension(std::uint32_t dimension) const {
    return static_cast<std::uint32_t>(mix(mixed_ + dimension) >> 32);  // As random_uniform(seed, 0, dimension).
  }

 private:
  std::uint64_t mixed_;
};

/// A coordinate of a Sobol point, with the direction numbers of Joe and Kuo 2008, from its index with reversed bits.
/// Dimension 0 is the van der Corput sequence.
constexpr std::uint32_t sobol_0(std::uint32_t reversed) { return reversed; }

/// Dimension 1 has the primitive polynomial x + 1, first number 1: bit j of the coordinate, counted from above, is the
/// sum of those bits i of the index for which the binomial coefficient of i and j is odd. By Lucas, these are the i
/// that have all the ones of j: a sum over supersets, one digit of the bits' numbers after the other.
constexpr std::uint32_t sobol_1(std::uint32_t reversed) {
  std::uint32_t x = reversed;
  x ^= (x << 1) & 0xaaaaaaaau;
  x ^= (x << 2) & 0xccccccccu;
  x ^= (x << 4) & 0xf0f0f0f0u;
  x ^= (x << 8) & 0xff00ff00u;
  x ^= (x << 16) & 0xffff0000u;
  return x;
}

/// Dimension 2 has the primitive polynomial x² + x + 1, first numbers 1 and 3: a recurrence.
constexpr std::uint32_t sobol_2(std::uint32_t reversed) {
  std::uint32_t x = 0, number = 0x80000000u, next = 3u << 30;
  for (; reversed != 0; reversed <<= 1) {
    x ^= number & (0u - (reversed >> 31));
    const std::uint32_t after = next ^ number ^ (number >> 2);
    number = next;
    next = after;
  }
  return x;
}

/// Dimension 3 has the primitive polynomial x³ + x + 1, first numbers 1, 3 and 1. From the index itself, as `sobol_2`
/// is from its reverse: of small indices, few bits are left to go through.
constexpr std::uint32_t sobol_3(std::uint32_t index) {
  std::uint32_t x = 0, number = 1u << 31, next = 3u << 30, second = 1u << 29;
  for (; index != 0; index >>= 1) {
    x ^= number & (0u - (index & 1));
    const std::uint32_t after = second;
    second = next ^ number ^ (number >> 3);
    number = next;
    next = after;
  }
  return x;
}

double scrambled(std::uint32_t x, std::uint32_t key) {
  return reverse_bits(scramble_reversed(reverse_bits(x), key)) * 0x1p-32;
}

constexpr std::uint32_t low_half(std::uint64_t key) { return static_cast<std::uint32_t>(key); }
constexpr std::uint32_t high_half(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); }

/// Scrambles a pair of coordinates twice.
SobolTwins twins(std::uint32_t x, std::uint32_t y, std::uint64_t key) {
  const std::uint64_t first = mix(key + 1), second = mix(key + 2);
  return {{scrambled(x, low_half(first)), scrambled(y, high_half(first))},
          {scrambled(x, low_half(second)), scrambled(y, high_half(second))}};
}

}  // namespace

/// Mixes after each key, so that different keys with equal sums give different results.
std::uint64_t random_key(std::uint64_t seed, std::uint64_t index) { return mix(mix(seed) + index); }

double random_uniform(std::uint64_t key, std::uint32_t dimension) {
  return static_cast<double>(mix(key + dimension) >> 11) * 0x1p-53;
}

double random_uniform(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension) {
  return random_uniform(random_key(seed, index), dimension);
}

double sobol(std::uint64_t seed, std::uint32_t index, std::uint32_t dimension) {
  if (dimension >= sobol_dimensions)
    throw std::invalid_argument("the Sobol sequence has dimensions 0 to 2 here, not " + std::to_string(dimension));
  const SequenceKeys keys(seed);
  const std::uint32_t reversed = scramble_reversed(reverse_bits(index), keys.shuffle());
  const std::uint32_t x = dimension == 0 ? sobol_0(reversed) : dimension == 1 ? sobol_1(reversed) : sobol_2(reversed);
  return scrambled(x, keys.of_dimension(dimension));
}

std::array<double, 2> sobol_pair(std::uint64_t seed, std::uint32_t index) {
  const SequenceKeys keys(seed);
  const std::uint32_t reversed = scramble_reversed(reverse_bits(index), keys.shuffle());
  return {scrambled(sobol_0(reversed), keys.of_dimension(0)), scrambled(sobol_1(reversed), keys.of_dimension(1))};
}

std::array<double, 2> joint_sobol_start(std::uint64_t key, std::uint32_t index) {
  const std::uint64_t scramble = mix(key);
  const std::uint32_t reversed = reverse_bits(index);
  return {scrambled(sobol_0(reversed), low_half(scramble)), scrambled(sobol_1(reversed), high_half(scramble))};
}

SobolTwins joint_sobol_twins(std::uint64_t key, std::uint32_t index) {
  return twins(sobol_2(reverse_bits(index)), sobol_3(index), key);
}

SobolTwins sobol_twins(std::uint64_t key, std::uint32_t index) {
  const std::uint32_t reversed = scramble_reversed(reverse_bits(index), low_half(mix(key)));
  return twins(sobol_0(reversed), sobol_1(reversed), key);
}

}  // namespace tensorray
