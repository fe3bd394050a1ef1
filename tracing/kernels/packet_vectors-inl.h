/// Vectors with a ray in each lane: arithmetic, and the order of numbers in them.

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using Bits = hn::RebindToUnsigned<Floats>;
using F = hn::Vec<Floats>;
using Mask = hn::Mask<Floats>;
constexpr Floats floats;
constexpr Ints ints;
constexpr Bits bits;
constexpr int lanes = static_cast<int>(hn::MaxLanes(Floats()));

struct F3 {
  F x, y, z;
};

/// The eight components of T − T₂₂ I, column by column.
struct Tensor {
  F c[8];
};

// `at` is the first lane of a vector of a packet.

HWY_INLINE F set(float value) { return hn::Set(floats, value); }
HWY_INLINE F load(const PerRay& from, int at) { return hn::Load(floats, from + at); }
HWY_INLINE F3 load(const PerRay (&from)[3], int at) {
  return {load(from[0], at), load(from[1], at), load(from[2], at)};
}
HWY_INLINE void store(F value, PerRay& to, int at) { hn::Store(value, floats, to + at); }
HWY_INLINE void store(const F3& v, PerRay (&to)[3], int at) {
  store(v.x, to[0], at);
  store(v.y, to[1], at);
  store(v.z, to[2], at);
}
HWY_INLINE F3 zeros() { return {hn::Zero(floats), hn::Zero(floats), hn::Zero(floats)}; }
HWY_INLINE F3 add(const F3& a, const F3& b) { return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)}; }
HWY_INLINE F3 sub(const F3& a, const F3& b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE F3 mul(F s, const F3& a) { return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)}; }
HWY_INLINE F3 mul_add(F s, const F3& a, const F3& b) {
  return {hn::MulAdd(s, a.x, b.x), hn::MulAdd(s, a.y, b.y), hn::MulAdd(s, a.z, b.z)};
}
HWY_INLINE F dot(const F3& a, const F3& b) { return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z))); }
HWY_INLINE F3 floor(const F3& a) { return {hn::Floor(a.x), hn::Floor(a.y), hn::Floor(a.z)}; }
HWY_INLINE F3 select(Mask mask, const F3& yes, const F3& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}
HWY_INLINE F3 minimum(const F3& a, const F3& b) { return {hn::Min(a.x, b.x), hn::Min(a.y, b.y), hn::Min(a.z, b.z)}; }
HWY_INLINE F3 clamp(const F3& p, const F3& low, const F3& high) {
  return {hn::Min(hn::Max(p.x, low.x), high.x), hn::Min(hn::Max(p.y, low.y), high.y),
          hn::Min(hn::Max(p.z, low.z), high.z)};
}
/// One bit for each lane of the packet.
HWY_INLINE std::uint32_t to_bits(Mask mask, int at) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(floats, mask, bytes);
  std::uint32_t result;
  std::memcpy(&result, bytes, sizeof result);
  return (result & ((1u << lanes) - 1)) << at;
}

/// The bits of a vector's lanes, given those of the packet.
HWY_INLINE std::uint32_t bits_of_vector(std::uint32_t packet, int at) { return packet >> at & ((1u << lanes) - 1); }

/// Calls f(lane) for each lane of `which`.
template <class Function>
HWY_INLINE void for_lanes(std::uint32_t which, const Function& f) {
  for (; which != 0; which &= which - 1) f(static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero32(which)));
}

/// The tensor whose stored component i is `stored(i)`.
template <int components, class Stored>
HWY_INLINE Tensor tensor_of(const Stored& stored) {
  Tensor T;
  for (int i = 0; i < 8; ++i) T.c[i] = stored(TensorBrick::stored_component(components, i));
  return T;
}

/// T V.
HWY_INLINE F3 apply(const Tensor& T, const F3& v) {
  return {hn::MulAdd(T.c[6], v.z, hn::MulAdd(T.c[3], v.y, hn::Mul(T.c[0], v.x))),
          hn::MulAdd(T.c[7], v.z, hn::MulAdd(T.c[4], v.y, hn::Mul(T.c[1], v.x))),
          hn::MulAdd(T.c[5], v.y, hn::Mul(T.c[2], v.x))};
}

/// Number of components of a tensor that a vector holds, where it holds those of one lane.
using Eight = hn::CappedTag<float, 8>;
using V8 = hn::Vec<Eight>;
constexpr Eight eight;
constexpr int eight_lanes = static_cast<int>(hn::MaxLanes(Eight()));

/// Four rows to four columns in each block of four.
HWY_INLINE void transpose_blocks(F* rows) {
  const hn::Repartition<double, Floats> pairs;
  const auto lower = [&](F a, F b) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveLower(floats, a, b)); };
  const auto upper = [&](F a, F b) HWY_ATTR { return hn::BitCast(pairs, hn::InterleaveUpper(floats, a, b)); };
  const auto near = lower(rows[0], rows[1]), near_2 = lower(rows[2], rows[3]);
  const auto far = upper(rows[0], rows[1]), far_2 = upper(rows[2], rows[3]);
  rows[0] = hn::BitCast(floats, hn::InterleaveLower(pairs, near, near_2));
  rows[1] = hn::BitCast(floats, hn::InterleaveUpper(pairs, near, near_2));
  rows[2] = hn::BitCast(floats, hn::InterleaveLower(pairs, far, far_2));
  rows[3] = hn::BitCast(floats, hn::InterleaveUpper(pairs, far, far_2));
}

/// Rows of the components of lanes to a vector for each component.
HWY_INLINE void transpose_rows(F (&rows)[eight_lanes]) {
  transpose_blocks(rows);
  if constexpr (eight_lanes == 8) {
    transpose_blocks(rows + 4);
    for (int i = 0; i < 4; ++i) {
      const F first = rows[i], second = rows[4 + i];
      rows[i] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(second), first);
      rows[4 + i] = hn::OddEvenBlocks(second, hn::SwapAdjacentBlocks(first));
    }
  }
}

/// A row: components of a lane, and, if vectors hold more, those of the lane that is eight further.
template <class Sample>
HWY_INLINE F row_of(const Sample& sample, int lane) {
  if constexpr (lanes > eight_lanes)
    return hn::Combine(floats, sample(lane + eight_lanes), sample(lane));
  else
    return sample(lane);
}
