/// A step of a packet: its length, its drifts and kicks (`splitting4`, methods.h), and its error. It leads from `now`
/// to `next`.

// Template arguments: `components`: those of a tensor that the field stores. `differentials`: whether rays have
// differentials.

// The length of a step.

/// The change of position per world unit along V, in index space.
HWY_INLINE F3 index_direction(const PacketMedium& medium, const F3& v) {
  const auto& m = medium.to_index;
  const auto row = [&](int i) HWY_ATTR {
    return hn::MulAdd(set(m[i][0]), v.x, hn::MulAdd(set(m[i][1]), v.y, hn::Mul(set(m[i][2]), v.z)));
  };
  return {row(0), row(1), row(2)};
}

/// |u|², voxels per `medium.unit`. (In world units, the squares may be beyond single precision.)
HWY_INLINE F squared_voxels_per_unit(const PacketMedium& medium, const Packet& packet, int at) {
  const F3 u = mul(set(medium.unit), load(packet.now.u, at));
  return dot(u, u);
}

/// Length of a voxel of level 0 along the rays, world units.
HWY_INLINE F voxel_along(const PacketMedium& medium, const Packet& packet, int at) {
  return hn::Div(set(medium.unit), hn::Sqrt(squared_voxels_per_unit(medium, packet, at)));
}

/// Sets the lengths of first steps. @param norms  KernelRay::norm.
static HWY_NOINLINE void begin_steps(const PacketMedium& medium, Packet& packet, const PerRay& norms) {
  const F longest = set(medium.longest_step), strongest = set(static_cast<float>(step_lengths::strongest_composed));
  for (int i = 0; i < packet_rays; i += lanes) {
    const F rate = hn::Mul(hn::Abs(load(packet.kick, i)), load(norms, i));
    const F kick = hn::Mul(rate, voxel_along(medium, packet, i));
    const F is_strong = hn::IfThenElse(hn::Gt(hn::Mul(kick, longest), strongest), hn::Div(strongest, kick), longest);
    store(medium.adaptive ? is_strong : longest, packet.wanted, i);
  }
}

/// The faces of the lanes' leaves, between which positions are.
struct LeafFaces {
  F3 low, high;
};

HWY_INLINE LeafFaces faces_of(const Packet& packet, int at) {
  const F cells = set(TensorBrick::cells);
  if (HWY_LIKELY(!packet.refined)) return {zeros(), {cells, cells, cells}};
  const F3 low = load(packet.first, at);
  const F size = hn::Div(cells, load(packet.scale, at));
  return {low, add(low, {size, size, size})};
}

/// The last step of lanes in leaves where nothing bends light ended a little beyond these leaves. This moves the lanes
/// to the leaves where they are now. (Other lanes move when their samples are located. What their neighbours do does
/// not matter.)
static HWY_NOINLINE void leave_straight_bricks(const PacketMedium& medium, Packet& packet) {
  const F zero = hn::Zero(floats);
  const auto moves = [&](int i) HWY_ATTR {
    const F3 p = load(packet.now.p, i);
    const auto [low, high] = faces_of(packet, i);
    const auto beyond = [](F x, F from, F to) HWY_ATTR { return hn::Or(hn::Lt(x, from), hn::Ge(x, to)); };
    return hn::And(hn::Eq(load(packet.strongest, i), zero),
                   hn::Or(beyond(p.x, low.x, high.x), hn::Or(beyond(p.y, low.y, high.y), beyond(p.z, low.z, high.z))));
  };
  std::uint32_t any = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) any |= to_bits(moves(i), i);
  if (any == 0) return;
  move_to_bricks(medium, packet, any, [&](int i) HWY_ATTR {
    const F3 p = clamp(load(packet.now.p, i), load(packet.low, i), load(packet.high, i));
    return select(moves(i), p, zeros());
  });
}

/// Limits the lanes' next steps by the voxels of their leaves.
HWY_INLINE F limited_by_leaf(const PacketMedium& medium, Packet& packet, F wanted, int at) {
  const F limited = hn::Min(wanted, hn::Div(set(medium.longest_step), load(packet.scale, at)));
  if (medium.adaptive) store(limited, packet.wanted, at);
  return limited;
}

/// Sets the length of the next step.
static HWY_NOINLINE void find_times(const PacketMedium& medium, Packet& packet) {
  if (packet.straight) leave_straight_bricks(medium, packet);
  const F zero = hn::Zero(floats);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F voxel = voxel_along(medium, packet, i);
    F wanted = load(packet.wanted, i);
    if (packet.refined) wanted = limited_by_leaf(medium, packet, wanted, i);
    F time = hn::Mul(wanted, voxel);
    if (packet.straight) {
      // The step ends a little beyond the leaf where nothing bends light, so that rounding does not keep the ray in
      // the leaf.
      const F3 p = load(packet.now.p, i), u = load(packet.now.u, i);
      const auto [low, high] = faces_of(packet, i);
      const auto way = [&](F x, F along, F from, F to) HWY_ATTR {
        const F rest = hn::Sub(hn::IfThenElse(hn::Gt(along, zero), to, from), x);
        return hn::IfThenElse(hn::Eq(along, zero), set(1e30f), hn::Div(rest, along));
      };
      const F out =
          hn::Min(hn::Min(way(p.x, u.x, low.x, high.x), way(p.y, u.y, low.y, high.y)), way(p.z, u.z, low.z, high.z));
      const auto within = [](F x, F from, F to) HWY_ATTR { return hn::And(hn::Ge(x, from), hn::Le(x, to)); };
      const Mask inside =
          hn::And(within(p.x, low.x, high.x), hn::And(within(p.y, low.y, high.y), within(p.z, low.z, high.z)));
      const Mask crosses = hn::And(inside, hn::And(hn::Eq(load(packet.strongest, i), zero), hn::Lt(out, set(1e29f))));
      const F past = set(static_cast<float>(step_lengths::past_straight_brick));
      time = hn::IfThenElse(crosses, hn::MulAdd(past, voxel, out), time);
    }
    store(time, packet.time, i);
  }
}

// A kick: V becomes exp(part · σ h T) V, normalised.

/// The rays of a packet within a step.
struct alignas(64) ComposedStep {
  PerRay ahead[3];  // Offset from p, voxels. (p itself moves when lanes enter other bricks.)
  PerRay v[3];
  PerRay error[3];  // Σ error[j] V_j.
  PerRay dp[2][3], dv[2][3];
  PerRay change;  // Λ so far.
};

/// 1 / √(1 + excess) for an excess below 0.006, to 7e-8: this error is below rounding, and the next step corrects it.
HWY_INLINE F inverse_root_near_one(F excess) {
  return hn::MulAdd(hn::MulAdd(set(3.0f / 8), excess, set(-0.5f)), excess, set(1));
}

/// The same for an excess below 0.0475, to 6e-8. That of exp(A) V is, if no two eigenvalues of A differ by more than
/// √2 · series_reach[1].
HWY_INLINE F inverse_root_nearby(F excess) {
  const F inner = hn::MulAdd(hn::MulAdd(set(35.0f / 128), excess, set(-5.0f / 16)), excess, set(3.0f / 8));
  return hn::MulAdd(hn::MulAdd(inner, excess, set(-0.5f)), excess, set(1));
}

/// |v|² − 1.
HWY_INLINE F excess_length(const F3& v) {
  return hn::MulAdd(v.x, v.x, hn::MulAdd(v.y, v.y, hn::MulAdd(v.z, v.z, set(-1))));
}

/// ln(1 + excess) for an excess below 0.006, to 1e-9.
HWY_INLINE F log_near_one(F excess) {
  const F inner = hn::MulAdd(hn::MulAdd(set(-0.25f), excess, set(1.0f / 3)), excess, set(-0.5f));
  return hn::Mul(hn::MulAdd(inner, excess, set(1)), excess);
}

/// The Frobenius norm of the deviator of factor · T. The factor comes first, because T itself may be too large, or too
/// small, for its square.
HWY_INLINE F deviator_norm(const Tensor& T, F factor) {
  F squares = hn::Zero(floats);
  for (int i = 0; i < 8; ++i) {
    const F scaled = hn::Mul(factor, T.c[i]);
    squares = hn::MulAdd(scaled, scaled, squares);
  }
  const F trace = hn::Mul(factor, hn::Add(T.c[0], T.c[4]));
  const F deviator = hn::Max(hn::NegMulAdd(hn::Mul(trace, trace), set(1.0f / 3), squares), hn::Zero(floats));
  return hn::Sqrt(hn::IfThenElse(hn::Le(squares, set(1e38f)), deviator, squares));  // Infinity stays infinite.
}

/// Sets packet.next.v and packet.change_of_step of the lanes of `which`, whose kicks are too strong for the series.
template <int components>
HWY_NOINLINE void kick_in_double(Packet& packet, const ComposedStep& step, float part, std::uint32_t which) {
  for_lanes(which, [&](int lane) {
    float T[9] = {}, v[3];
    for (int i = 0; i < 8; ++i) T[i] = packet.tensor[TensorBrick::stored_component(components, i)][lane];
    for (int axis = 0; axis < 3; ++axis) v[axis] = step.v[axis][lane];
    const StrongKick kick = strong_kick(T, part * packet.time[lane] * packet.kick[lane], v);
    for (int axis = 0; axis < 3; ++axis) packet.next.v[axis][lane] = kick.direction[axis];
    packet.change_of_step[lane] = kick.log_radiance_scale;
  });
}

/// exp(factor · T) V, normalised, and its Λ, for any strength. How a lane is computed depends on that lane alone. The
/// results are stored, in packet.next.v and packet.change_of_step: a returned value would pass through memory in halves
/// of vectors, which stalls the processor.
/// @param size  ‖factor · T‖, or an upper bound of it.
template <int components, bool differentials>
HWY_INLINE void bend(Packet& packet, const ComposedStep& step, const Tensor& T, const F3& v, float part, F factor,
                     F size, int at) {
  int terms = 2;
  while (terms < max_terms && !hn::AllTrue(floats, hn::Le(size, set(series_reach[terms - 2])))) ++terms;
  F3 inner = v;  // Horner's rule, from the last term that any lane needs.
  for (int n = terms; n > 2; --n) {
    const F nth = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
    inner = select(hn::Gt(size, set(series_reach[n - 3])), mul_add(nth, apply(T, inner), v), v);
  }
  const F3 half = mul_add(hn::Mul(set(0.5f), factor), apply(T, inner), v);
  const F3 sum = mul_add(factor, apply(T, half), v);
  const F e = excess_length(sum);
  const Mask weak = hn::Le(size, set(series_reach[0])), fits = hn::Le(size, set(1));
  F scale = inverse_root_near_one(e);
  if (terms > 2) scale = hn::IfThenElse(weak, scale, inverse_root_nearby(e));
  if (terms > 3) {
    const F root = hn::Div(set(1), hn::Sqrt(hn::Add(e, set(1))));
    scale = hn::IfThenElse(hn::Le(size, set(series_reach[1])), scale, root);
  }
  if constexpr (differentials) {
    // Rays with differentials stop where no series is exact enough.
    store(mul(hn::IfThenElseZero(fits, scale), sum), packet.next.v, at);
  } else {
    F log_squared = log_near_one(e);
    if (!hn::AllTrue(floats, weak)) log_squared = hn::IfThenElse(weak, log_squared, hn::Log1p(floats, e));
    // Λ = factor tr T − 3 ln |exp(factor · T) V|. Adding c I to T does not change it.
    const F change = hn::MulAdd(factor, hn::Add(T.c[0], T.c[4]), hn::Mul(set(-1.5f), log_squared));
    store(change, packet.change_of_step, at);
    store(mul(scale, sum), packet.next.v, at);
    if (HWY_UNLIKELY(!hn::AllTrue(floats, fits)))
      kick_in_double<components>(packet, step, part, to_bits(hn::Not(fits), at));
  }
}

/// The derivatives of exp(factor · T) V, normalised, along a parameter along which T and V change by dT and dv. They
/// are the derivatives of the method's own steps. The series has one more term than without derivatives, because
/// differentiation removes one.
HWY_INLINE F3 bend_differential(const Tensor& T, const Tensor& dT, const F3& v, const F3& dv, F factor, F size) {
  F3 term = v, sum = v, dterm = dv, dsum = dterm;
  for (int n = 1; n <= max_terms; ++n) {
    const Mask needed = hn::Gt(size, set(n < 4 ? -1.0f : series_reach[n - 4]));
    if (hn::AllFalse(floats, needed)) break;
    const F part = hn::Mul(set(1.0f / static_cast<float>(n)), factor);
    dterm = mul(part, add(apply(T, dterm), apply(dT, term)));
    term = mul(part, apply(T, term));
    sum = add(sum, select(needed, term, zeros()));
    dsum = add(dsum, select(needed, dterm, zeros()));
  }
  const F inverse = hn::Div(set(1), hn::Sqrt(dot(sum, sum)));
  const F3 unit = mul(inverse, sum), change = mul(inverse, dsum);
  return mul_add(hn::Neg(dot(unit, change)), unit, change);
}

/// Change of the tensor if the position changes by dp, in index space.
template <int components>
HWY_INLINE Tensor tensor_along(const PacketMedium& medium, const Packet& packet, const F3& dp, int at) {
  // The tensor does not change along axes of a single voxel.
  F3 along{hn::Mul(dp.x, set(medium.slope[0])), hn::Mul(dp.y, set(medium.slope[1])),
           hn::Mul(dp.z, set(medium.slope[2]))};
  if (packet.refined) along = mul(load(packet.scale, at), along);
  return tensor_of<components>([&](int i) HWY_ATTR {
    return dot(along, {load(packet.slopes[0][i], at), load(packet.slopes[1][i], at), load(packet.slopes[2][i], at)});
  });
}

/// Kicks the rays with the tensors as last sampled, for the part `part` of the step.
template <int components, bool differentials>
HWY_INLINE void kick(const PacketMedium& medium, Packet& packet, double part, ComposedStep& step) {
  const float single = static_cast<float>(part);
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F factor = hn::Mul(hn::Mul(set(single), load(packet.time, i)), load(packet.kick, i));
    const Tensor T = tensor_of<components>([&](int c) HWY_ATTR { return load(packet.tensor[c], i); });
    const F3 before = load(step.v, i);
    F size = load(packet.reach, i);
    if (HWY_UNLIKELY(!(packet.max_reach <= strongest_kick)))
      size = hn::IfThenElse(hn::Le(size, set(strongest_kick)), size, deviator_norm(T, factor));
    bend<components, differentials>(packet, step, T, before, single, factor, size, i);
    if constexpr (differentials) {
      for (int k = 0; k < 2; ++k) {
        const Tensor dT = tensor_along<components>(medium, packet, load(step.dp[k], i), i);
        store(bend_differential(T, dT, before, load(step.dv[k], i), factor, size), step.dv[k], i);
      }
    } else {
      store(hn::Add(load(step.change, i), load(packet.change_of_step, i)), step.change, i);
    }
    store(load(packet.next.v, i), step.v, i);
  }
}

// The step.

template <bool differentials>
HWY_INLINE void begin_step(const PacketMedium& medium, const Packet& packet, ComposedStep& step) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 v = load(packet.now.v, i);
    store(zeros(), step.ahead, i);
    store(v, step.v, i);
    store(mul(set(static_cast<float>(medium.method.error[0])), v), step.error, i);
    store(hn::Zero(floats), step.change, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        store(load(packet.now.dp[k], i), step.dp[k], i);
        store(load(packet.now.dv[k], i), step.dv[k], i);
      }
  }
}

/// Moves the rays along their directions for the part `part` of the step.
template <bool differentials>
HWY_INLINE void drift(const PacketMedium& medium, const Packet& packet, double part, ComposedStep& step) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = hn::Mul(set(static_cast<float>(part)), load(packet.time, i));
    const auto moved = [&](const PerRay(&p)[3], const PerRay(&v)[3])
                           HWY_ATTR { return mul_add(time, index_direction(medium, load(v, i)), load(p, i)); };
    store(moved(step.ahead, step.v), step.ahead, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) store(moved(step.dp[k], step.dv[k]), step.dp[k], i);
  }
}

/// Stores the end of the step as the packet's next, and the error estimate divided by the tolerance.
template <bool differentials>
HWY_INLINE void end_step(const PacketMedium& medium, Packet& packet, const ComposedStep& step) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F3 v = load(step.v, i);
    store(add(load(packet.now.p, i), load(step.ahead, i)), packet.next.p, i);
    store(v, packet.next.v, i);
    store(index_direction(medium, v), packet.next.u, i);
    store(load(step.change, i), packet.change_of_step, i);
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        store(load(step.dp[k], i), packet.next.dp[k], i);
        store(load(step.dv[k], i), packet.next.dv[k], i);
      }
    const F3 error = load(step.error, i);
    const F squares = hn::Mul(dot(error, error), squared_voxels_per_unit(medium, packet, i));
    const F time = hn::Div(load(packet.time, i), set(medium.unit));
    store(hn::Mul(hn::Mul(time, hn::Sqrt(squares)), set(1 / medium.settings.tolerance)), packet.excess, i);
  }
}

/// Sets `finest`, at the beginning of a step or with another sample of it.
HWY_INLINE void keep_finest(Packet& packet, bool is_first) {
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F scale = load(packet.scale, i);
    store(is_first ? scale : hn::Max(scale, load(packet.finest, i)), packet.finest, i);
  }
}

/// Takes a step of length `time`. May move lanes to other leaves.
template <int components, bool differentials>
HWY_NOINLINE void take_step(const PacketMedium& medium, Packet& packet) {
  ComposedStep step;
  begin_step<differentials>(medium, packet, step);
  if (medium.levels) keep_finest(packet, true);
  bool near_surface = false;  // In any brick that is sampled.
  for (int n = 0; n < medium.method.kicks; ++n) {
    drift<differentials>(medium, packet, medium.method.drift[n], step);
    locate(medium, packet, [&](int i) HWY_ATTR { return add(load(packet.now.p, i), load(step.ahead, i)); });
    near_surface |= packet.near_surface;
    if (medium.levels) keep_finest(packet, false);
    sample_tensors<components, differentials>(packet);
    kick<components, differentials>(medium, packet, medium.method.kick[n], step);
    const F weight = set(static_cast<float>(medium.method.error[n + 1]));
    for (int i = 0; i < packet.vectors * lanes; i += lanes)
      store(mul_add(weight, load(step.v, i), load(step.error, i)), step.error, i);
  }
  packet.near_surface |= near_surface;
  drift<differentials>(medium, packet, medium.method.drift[medium.method.kicks], step);
  end_step<differentials>(medium, packet, step);
}

// The control of errors.

/// The lanes whose steps are too short for single precision, as bits.
HWY_INLINE std::uint32_t too_short(const PacketMedium& medium, const Packet& packet) {
  std::uint32_t result = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F time = hn::Div(load(packet.time, i), set(medium.unit));
    const F squares = hn::Mul(hn::Mul(time, time), squared_voxels_per_unit(medium, packet, i));
    result |= to_bits(hn::Not(hn::Ge(squares, set(shortest_step * shortest_step))), i);
  }
  return result;
}

/// Copies a lane of one state to a lane of another.
template <bool differentials>
HWY_INLINE void copy_state(const RayState& from, int of, RayState& to, int lane) {
  for (int axis = 0; axis < 3; ++axis) {
    to.p[axis][lane] = from.p[axis][of];
    to.v[axis][lane] = from.v[axis][of];
    to.u[axis][lane] = from.u[axis][of];
    if constexpr (differentials)
      for (int k = 0; k < 2; ++k) {
        to.dp[k][axis][lane] = from.dp[k][axis][of];
        to.dv[k][axis][lane] = from.dv[k][axis][of];
      }
  }
}

/// The next step divided by the last one: see methods.h.
HWY_INLINE F growth(F excess) {
  using namespace step_lengths;
  const auto single = [](double value) HWY_ATTR { return set(static_cast<float>(value)); };
  const F within = hn::Min(hn::Max(excess, single(min_excess)), set(1e30f));
  const F root = hn::Exp(floats, hn::Mul(single(-1.0 / composed_order), hn::Log(floats, within)));
  const F factor = hn::Mul(single(composed_safety), root), least = single(min_growth), most = single(max_growth);
  return hn::IfThenElse(hn::Eq(excess, excess), hn::Min(hn::Max(factor, least), most), least);
}

/// Sets the next steps from the errors of these. Lanes with too great an error stay, and those whose step was too long
/// for a finer leaf into which it led: samples might miss what is there.
/// @return the lanes that stay, as bits.
template <bool differentials>
HWY_NOINLINE std::uint32_t control_steps(const PacketMedium& medium, Packet& packet) {
  std::uint32_t staying = 0;
  for (int i = 0; i < packet.vectors * lanes; i += lanes) {
    const F excess = load(packet.excess, i), wanted = load(packet.wanted, i);
    F longest = set(medium.longest_step);
    Mask fails = hn::Gt(excess, set(1));
    if (medium.levels) {
      longest = hn::Div(longest, load(packet.finest, i));
      fails =
          hn::Or(fails, hn::Gt(wanted, hn::Mul(set(static_cast<float>(step_lengths::longest_into_finer)), longest)));
    }
    store(hn::Min(hn::Mul(wanted, growth(excess)), longest), packet.wanted, i);
    const F3 v = load(packet.next.v, i);  // A lane without a direction does not stay: it stops, whatever its error.
    staying |= to_bits(hn::And(fails, hn::Gt(dot(v, v), hn::Zero(floats))), i);
  }
  for_lanes(staying, [&](int lane) {
    packet.time[lane] = packet.change_of_step[lane] = 0;
    copy_state<differentials>(packet.now, lane, packet.next, lane);
  });
  return staying;
}
