/// The tensor at the sample points of a packet: sums of 4³ coefficients of cubic B-splines.

/// Weights of the four coefficients about each lane along each axis, and their derivatives.
struct alignas(64) SplineWeights {
  float value[3][4][lanes], slope[3][4][lanes];
};

/// The weights of the cubic B-spline and, if `slopes`, their derivatives (CubicTaps of tensor_sampler.cpp).
template <bool slopes>
HWY_INLINE void find_weights(const Packet& packet, int at, SplineWeights& weights) {
  const F sixth = set(1.0f / 6), two_thirds = set(2.0f / 3), half = set(0.5f), one = set(1), two = set(2);
  for (int axis = 0; axis < 3; ++axis) {
    const F t = load(packet.fraction[axis], at), u = hn::Sub(one, t);
    const F tt = hn::Mul(t, t), uu = hn::Mul(u, u);
    auto& value = weights.value[axis];
    hn::Store(hn::Mul(hn::Mul(uu, u), sixth), floats, value[0]);
    hn::Store(hn::NegMulAdd(hn::Mul(half, tt), hn::Sub(two, t), two_thirds), floats, value[1]);
    hn::Store(hn::NegMulAdd(hn::Mul(half, uu), hn::Sub(two, u), two_thirds), floats, value[2]);
    hn::Store(hn::Mul(hn::Mul(tt, t), sixth), floats, value[3]);
    if constexpr (slopes) {
      auto& slope = weights.slope[axis];
      const F three_halves = set(1.5f);
      hn::Store(hn::Mul(hn::Neg(half), uu), floats, slope[0]);
      hn::Store(hn::Mul(t, hn::MulSub(three_halves, t, two)), floats, slope[1]);
      hn::Store(hn::Mul(u, hn::NegMulAdd(three_halves, u, two)), floats, slope[2]);
      hn::Store(hn::Mul(half, tt), floats, slope[3]);
    }
  }
}

/// The first of the 4³ coefficients about a lane.
template <int components>
HWY_INLINE const float* first_coefficient(const Packet& packet, int lane) {
  return packet.bending[lane] + CubicBrick::bending_offset(components, static_cast<int>(packet.voxel[lane]));
}

template <int components>
constexpr int row_stride = CubicBrick::bending_offset(components, CubicBrick::width);
template <int components>
constexpr int sheet_stride = row_stride<components>* CubicBrick::width;

/// Components of four coefficients along z, or of sums of such.
struct Four {
  V8 z[4];
};

// A row is four coefficients along z as they are loaded: in four vectors; with AVX-512 in two, of two coefficients with
// eight components, or of three with five and the last one; with AVX2 in three, where coefficients have five
// components.

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
template <int components>
using Far = std::conditional_t<components == TensorBrick::general, Floats, Eight>;

template <int components>
struct Row {
  F near;
  hn::Vec<Far<components>> far;
};

template <int components>
HWY_INLINE Row<components> empty_row() {
  return {hn::Zero(floats), hn::Zero(Far<components>())};
}

template <int components>
HWY_INLINE Row<components> load_row(const float* from) {
  return {hn::LoadU(floats, from),
          hn::LoadU(Far<components>(), from + (components == TensorBrick::general ? 16 : 3 * components))};
}

template <int components>
HWY_INLINE Row<components> add_row(float weight, const Row<components>& row, const Row<components>& to) {
  return {hn::MulAdd(set(weight), row.near, to.near), hn::MulAdd(hn::Set(Far<components>(), weight), row.far, to.far)};
}

template <int components>
HWY_INLINE Four four_of(const Row<components>& row) {
  const auto lower = [](F v) HWY_ATTR { return hn::LowerHalf(eight, v); };
  if constexpr (components == TensorBrick::general) {
    return {{lower(row.near), hn::UpperHalf(eight, row.near), lower(row.far), hn::UpperHalf(eight, row.far)}};
  } else {
    alignas(64) constexpr std::int32_t from[2][16] = {{5, 6, 7, 8, 9, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5},
                                                      {10, 11, 12, 13, 14, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5}};
    const auto moved = [&](int i) HWY_ATTR {
      return lower(hn::TableLookupLanes(row.near, hn::SetTableIndices(floats, from[i])));
    };
    return {{lower(row.near), moved(0), moved(1), row.far}};
  }
}
#else
/// Whether the vectors of a row follow each other without gaps, but for the last one, which is the last coefficient.
template <int components>
constexpr bool is_packed = (HWY_TARGET == HWY_AVX2) && (components == TensorBrick::symmetric);

template <int components>
struct Row {
  static constexpr int count = is_packed<components> ? 3 : 4;
  V8 part[count];

  /// Where a vector begins in the row.
  static constexpr int offset(int i) {
    return is_packed<components> && i < count - 1 ? 8 * i : (i + 4 - count) * components;
  }
};

template <int components>
HWY_INLINE Row<components> empty_row() {
  Row<components> row;
#pragma GCC unroll 4
  for (V8& part : row.part) part = hn::Zero(eight);
  return row;
}

template <int components>
HWY_INLINE Row<components> load_row(const float* from) {
  Row<components> row;
#pragma GCC unroll 4
  for (int i = 0; i < row.count; ++i) row.part[i] = hn::LoadU(eight, from + row.offset(i));
  return row;
}

template <int components>
HWY_INLINE Row<components> add_row(float weight, const Row<components>& row, const Row<components>& to) {
  const V8 w = hn::Set(eight, weight);
  Row<components> sum;
#pragma GCC unroll 4
  for (int i = 0; i < row.count; ++i) sum.part[i] = hn::MulAdd(w, row.part[i], to.part[i]);
  return sum;
}

template <int components>
HWY_INLINE Four four_of(const Row<components>& row) {
#if HWY_TARGET == HWY_AVX2
  if constexpr (is_packed<components>) {
    alignas(32) constexpr std::int32_t from[2][8] = {{1, 2, 3, 4, 5, 1, 1, 1}, {2, 3, 4, 5, 6, 2, 2, 2}};
    const auto moved = [&](V8 v, int i)
                           HWY_ATTR { return hn::TableLookupLanes(v, hn::SetTableIndices(eight, from[i])); };
    const V8 across = hn::ConcatLowerUpper(eight, row.part[1], row.part[0]);  // The row from 4 to 11.
    return {{row.part[0], moved(across, 0), moved(row.part[1], 1), row.part[2]}};
  } else
#endif
    return {{row.part[0], row.part[1], row.part[2], row.part[3]}};
}
#endif

/// A value and its slopes.
struct Slopes {
  V8 value, x, y, z;
};

// The sums along y, then x, then z. The operations of a lane and their order are the same in all functions below, and
// so are the results, bit for bit.

HWY_INLINE V8 along_z(const Four& sums, const float (&weights)[4][lanes], int lane) {
  const auto weight = [&](int k) HWY_ATTR { return hn::Set(eight, weights[k][lane]); };
  return hn::MulAdd(weight(0), sums.z[0],
                    hn::MulAdd(weight(1), sums.z[1], hn::MulAdd(weight(2), sums.z[2], hn::Mul(weight(3), sums.z[3]))));
}

/// Components of a lane's tensor. @param first  Its first coefficient, from the first of these components on.
template <int components>
HWY_INLINE V8 spline_value(const float* first, const SplineWeights& weights, int lane) {
  Row<components> sums = empty_row<components>();
#pragma GCC unroll 4
  for (int x = 0; x < 4; ++x) {
    Row<components> lines = empty_row<components>();
#pragma GCC unroll 4
    for (int y = 0; y < 4; ++y)
      lines = add_row(weights.value[1][y][lane],
                      load_row<components>(first + x * sheet_stride<components> + y * row_stride<components>), lines);
    sums = add_row(weights.value[0][x][lane], lines, sums);
  }
  return along_z(four_of<components>(sums), weights.value[2], lane);
}

/// The same with the slopes.
template <int components>
HWY_INLINE Slopes spline_slopes(const float* first, const SplineWeights& weights, int lane) {
  Row<components> sums = empty_row<components>(), by_x = sums, by_y = sums;
#pragma GCC unroll 4
  for (int x = 0; x < 4; ++x) {
    Row<components> lines = empty_row<components>(), slopes = lines;
#pragma GCC unroll 4
    for (int y = 0; y < 4; ++y) {
      const Row<components> row =
          load_row<components>(first + x * sheet_stride<components> + y * row_stride<components>);
      lines = add_row(weights.value[1][y][lane], row, lines);
      slopes = add_row(weights.slope[1][y][lane], row, slopes);
    }
    sums = add_row(weights.value[0][x][lane], lines, sums);
    by_x = add_row(weights.slope[0][x][lane], lines, by_x);
    by_y = add_row(weights.value[0][x][lane], slopes, by_y);
  }
  const auto& along = weights.value[2];
  const Four values = four_of<components>(sums);
  return {along_z(values, along, lane), along_z(four_of<components>(by_x), along, lane),
          along_z(four_of<components>(by_y), along, lane), along_z(values, weights.slope[2], lane)};
}

/// Stores components c and following of the tensors of a vector, of which a row holds those of a lane (or two lanes:
/// see row_of).
template <int components>
HWY_INLINE void store_rows(F (&rows)[eight_lanes], int c, PerRay (&tensor)[8], int at) {
  transpose_rows(rows);
  for (int row = 0; row < std::min(eight_lanes, components - c); ++row) store(rows[row], tensor[c + row], at);
}

/// Whether all lanes of a vector are in one cell.
HWY_INLINE bool in_one_cell(const Packet& packet, int at) {
  Mask same = hn::Eq(load(packet.voxel, at), set(packet.voxel[at]));
  for (const auto& brick : packet.brick)
    same = hn::And(same, hn::RebindMask(floats, hn::Eq(hn::Load(ints, brick + at), hn::Set(ints, brick[at]))));
  for (int axis = 0; packet.refined && axis < 3; ++axis)
    same = hn::And(same, hn::Eq(load(packet.first[axis], at), set(packet.first[axis][at])));
  if (packet.refined) same = hn::And(same, hn::Eq(load(packet.scale, at), set(packet.scale[at])));
  return hn::AllTrue(floats, same);
}

/// Samples the tensors of a vector whose lanes are all in one cell. Each coefficient is loaded once, and copied to all
/// lanes.
template <int components>
HWY_INLINE void sample_cell(Packet& packet, int at) {
  SplineWeights weights;
  find_weights<false>(packet, at, weights);
  const float* const first = first_coefficient<components>(packet, at);
  const auto weight = [&](int axis, int k) HWY_ATTR { return hn::Load(floats, weights.value[axis][k]); };
  for (int c = 0; c < components; ++c) {
    F sums[4];
#pragma GCC unroll 4
    for (int z = 0; z < 4; ++z) {
      F sum = hn::Zero(floats);
#pragma GCC unroll 4
      for (int x = 0; x < 4; ++x) {
        const float* const line = first + x * sheet_stride<components> + z * components + c;
        F along_y = hn::Zero(floats);
#pragma GCC unroll 4
        for (int y = 0; y < 4; ++y) along_y = hn::MulAdd(weight(1, y), set(line[y * row_stride<components>]), along_y);
        sum = hn::MulAdd(weight(0, x), along_y, sum);
      }
      sums[z] = sum;
    }
    const F value = hn::MulAdd(
        weight(2, 0), sums[0],
        hn::MulAdd(weight(2, 1), sums[1], hn::MulAdd(weight(2, 2), sums[2], hn::Mul(weight(2, 3), sums[3]))));
    store(value, packet.tensor[c], at);
  }
}

/// Samples the tensors of a vector whose lanes are in several cells: lane by lane.
template <int components>
HWY_INLINE void sample_cells(Packet& packet, int at) {
  SplineWeights weights;
  find_weights<false>(packet, at, weights);
  for (int c = 0; c < components; c += eight_lanes) {
    F rows[eight_lanes];
    for (int row = 0; row < eight_lanes; ++row)
      rows[row] = row_of(
          [&](int lane) HWY_ATTR {
            return spline_value<components>(first_coefficient<components>(packet, at + lane) + c, weights, lane);
          },
          row);
    store_rows<components>(rows, c, packet.tensor, at);
  }
}

/// The same with their slopes.
template <int components>
HWY_INLINE void sample_slopes(Packet& packet, int at) {
  SplineWeights weights;
  find_weights<true>(packet, at, weights);
  for (int c = 0; c < components; c += eight_lanes) {
    Slopes sampled[lanes];
    for (int lane = 0; lane < lanes; ++lane)
      sampled[lane] = spline_slopes<components>(first_coefficient<components>(packet, at + lane) + c, weights, lane);
    const auto store_all = [&](V8 Slopes::*member, PerRay(&tensor)[8]) HWY_ATTR {
      F rows[eight_lanes];
      for (int row = 0; row < eight_lanes; ++row)
        rows[row] = row_of([&](int lane) HWY_ATTR { return sampled[lane].*member; }, row);
      store_rows<components>(rows, c, tensor, at);
    };
    store_all(&Slopes::value, packet.tensor);
    store_all(&Slopes::x, packet.slopes[0]);
    store_all(&Slopes::y, packet.slopes[1]);
    store_all(&Slopes::z, packet.slopes[2]);
  }
}

/// Samples the tensors of all lanes, and, with `differentials`, their slopes.
template <int components, bool differentials>
HWY_INLINE void sample_tensors(Packet& packet) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    if constexpr (differentials)
      sample_slopes<components>(packet, i);
    else if (in_one_cell(packet, i))
      sample_cell<components>(packet, i);
    else
      sample_cells<components>(packet, i);
  }
}
