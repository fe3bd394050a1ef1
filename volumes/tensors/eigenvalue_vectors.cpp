#include "volumes/tensors/eigenvalue_vectors.h"

// The code before HWY_AFTER_NAMESPACE is compiled once for each kind of processor. It calls no inline functions of
// other headers: the linker would keep only one of their copies, which may be compiled for the wrong processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volumes/tensors/eigenvalue_vectors.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// Must come after foreach_target.h:
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tensorray {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

/// Least distance between the eigenvalues of a tensor of norm 1 that is not symmetric.
constexpr double apart = 0.002;

HWY_INLINE V set(double x) { return hn::Set(D(), x); }
HWY_INLINE V select(M which, V yes, V no) { return hn::IfThenElse(which, yes, no); }
HWY_INLINE V flag(M which) { return hn::IfThenElseZero(which, set(1)); }
HWY_INLINE V root(V x) { return hn::Sqrt(hn::Max(x, hn::Zero(D()))); }
HWY_INLINE V square(V x) { return hn::Mul(x, x); }

/// T = m I + B. The eigenvalues of B, whose trace is zero, are the roots of x³ − 3 p x − 2 q.
struct Cubic {
  V mean, p, q;
};

HWY_INLINE Cubic characteristic_cubic(const V (&T)[9]) {
  const V mean = hn::Mul(hn::Add(hn::Add(T[0], T[4]), T[8]), set(1.0 / 3));
  const V a = hn::Sub(T[0], mean), b = hn::Sub(T[4], mean), c = hn::Sub(T[8], mean);
  const V across = hn::MulAdd(T[5], T[7], hn::MulAdd(T[2], T[6], hn::Mul(T[1], T[3])));
  const V along = hn::MulAdd(c, c, hn::MulAdd(b, b, square(a)));
  const V first = hn::Mul(a, hn::MulSub(b, c, hn::Mul(T[5], T[7])));
  const V second = hn::Mul(T[1], hn::MulSub(T[5], T[6], hn::Mul(T[3], c)));
  const V third = hn::Mul(T[2], hn::MulSub(T[3], T[7], hn::Mul(b, T[6])));
  return {mean, hn::Mul(hn::MulAdd(across, set(2), along), set(1.0 / 6)),
          hn::Mul(hn::Add(hn::Add(first, second), third), set(0.5))};
}

struct RealRoots {
  V high, middle, low;
};

/// The roots are 2 √p cos(θ), cos(3θ) = q/√p³. For q >= 0 the largest cosine, c, is in [½√3, 1], where Newton's method
/// finds it from 4 c³ − 3 c = |q|/√p³ in three steps. For q < 0 all roots change their signs.
HWY_INLINE RealRoots real_roots(const Cubic& cubic) {
  const V scale = root(cubic.p), cube = hn::Mul(scale, square(scale));
  const V ratio = hn::Min(hn::IfThenElseZero(hn::Gt(cube, hn::Zero(D())), hn::Div(hn::Abs(cubic.q), cube)), set(1));
  V c = hn::MulAdd(ratio, hn::MulAdd(ratio, set(-0.0326921), set(0.1666667)), set(0.8660254));
  for (int i = 0; i < 3; ++i)
    c = hn::Div(hn::MulAdd(hn::Mul(set(8), c), square(c), ratio), hn::MulSub(hn::Mul(set(12), c), c, set(3)));
  const V s = hn::Mul(set(0.86602540378443865), root(hn::Mul(hn::Sub(set(1), c), hn::Add(set(1), c))));
  const V half = hn::Mul(set(0.5), c), twice = hn::Add(scale, scale);
  const M down = hn::Lt(cubic.q, hn::Zero(D()));
  const auto shifted = [&](V x) { return hn::MulAdd(twice, x, cubic.mean); };
  return {shifted(select(down, hn::Add(half, s), c)), shifted(select(down, hn::Sub(half, s), hn::Sub(s, half))),
          shifted(select(down, hn::Neg(c), hn::Neg(hn::Add(half, s))))};
}

/// The result is a T² + b T + c I.
struct Polynomial {
  V a, b, c;
};

HWY_INLINE Polynomial select(M which, const Polynomial& yes, const Polynomial& no) {
  return {select(which, yes.a, no.a), select(which, yes.b, no.b), select(which, yes.c, no.c)};
}

/// `absolute_of_real` of eigenvalues.cpp.
HWY_INLINE Polynomial absolute_of_real(const RealRoots& roots) {
  const V zero = hn::Zero(D());
  const auto is_zero = [&](V x) { return hn::Le(hn::Abs(x), set(eigenvalue_tolerance)); };
  const V zeros = hn::Add(hn::Add(flag(is_zero(roots.high)), flag(is_zero(roots.middle))), flag(is_zero(roots.low)));
  // One eigenvalue differs in sign from the others.
  const M odd_is_low = hn::Ge(roots.middle, zero);
  const V odd = select(odd_is_low, roots.low, roots.high), far = select(odd_is_low, roots.high, roots.low);
  const V near = roots.middle, sign = select(odd_is_low, set(1), set(-1));
  const V k = hn::Div(hn::Add(odd, odd), hn::Mul(hn::Sub(odd, near), hn::Sub(odd, far)));
  Polynomial result{hn::Neg(hn::Mul(sign, k)), hn::Mul(sign, hn::MulAdd(k, hn::Add(near, far), set(1))),
                    hn::Neg(hn::Mul(sign, hn::Mul(k, hn::Mul(near, far))))};
  result = select(hn::Le(roots.high, zero), {zero, set(-1), zero}, result);
  result = select(hn::Ge(roots.low, zero), {zero, set(1), zero}, result);
  const V only = select(hn::Gt(roots.high, set(eigenvalue_tolerance)), roots.high, roots.low);
  result = select(hn::Eq(zeros, set(2)), {hn::Div(set(1), hn::Abs(only)), zero, zero}, result);
  return select(hn::Eq(zeros, set(3)), {zero, zero, zero}, result);
}

/// A real eigenvalue, and the pair α ± iβ.
struct Pair {
  V real, alpha, beta, squared_modulus;
};

/// By Cardano's formula, and two steps of Newton's method, because terms of the formula may cancel.
HWY_INLINE Pair pair(const Cubic& cubic, V discriminant) {
  const V big = hn::Max(hn::Add(hn::Abs(cubic.q), root(discriminant)), set(1e-30));
  const V third = hn::Exp(D(), hn::Mul(hn::Log(D(), big), set(1.0 / 3)));
  V x = hn::CopySign(hn::Add(third, hn::Div(cubic.p, third)), cubic.q);
  for (int i = 0; i < 2; ++i) {
    const V rest = hn::MulSub(x, hn::MulSub(x, x, hn::Mul(set(3), cubic.p)), hn::Add(cubic.q, cubic.q));
    x = hn::Sub(x, hn::Div(rest, hn::Mul(set(3), hn::MulSub(x, x, cubic.p))));
  }
  const V alpha = hn::MulAdd(set(-0.5), x, cubic.mean);
  const V squared_beta = hn::MulSub(hn::Mul(set(0.75), x), x, hn::Mul(set(3), cubic.p));
  return {hn::Add(cubic.mean, x), alpha, root(squared_beta), hn::MulAdd(alpha, alpha, squared_beta)};
}

/// `absolute_of_pair` and `positive_of_pair` of eigenvalues.cpp. The projector on the eigenvector of the real
/// eigenvalue is (T² − 2αT + r² I) / ((λ − α)² + β²).
HWY_INLINE Polynomial of_pair(const Pair& pair, bool positive, M& on_cut) {
  const V distance = hn::Sub(pair.real, pair.alpha);
  const V divisor = hn::MulAdd(distance, distance, square(pair.beta));
  V factor, b = hn::Zero(D()), c = hn::Zero(D());
  if (positive) {
    on_cut = hn::Le(hn::Abs(pair.alpha), set(eigenvalue_tolerance));
    const V real_sign = select(hn::Lt(pair.real, hn::Zero(D())), set(-1), set(1));
    b = select(hn::AndNot(on_cut, hn::Lt(pair.alpha, hn::Zero(D()))), set(-1), set(1));
    factor = hn::IfThenZeroElse(hn::Eq(b, real_sign), hn::Div(hn::Abs(hn::Add(pair.real, pair.real)), divisor));
  } else {
    c = root(pair.squared_modulus);
    factor = hn::Div(hn::Sub(hn::Abs(pair.real), c), divisor);
  }
  return {factor, hn::NegMulAdd(hn::Add(pair.alpha, pair.alpha), factor, b),
          hn::MulAdd(factor, pair.squared_modulus, c)};
}

/// R = a T² + b T + c I.
HWY_INLINE void evaluate(const Polynomial& f, const V (&T)[9], V (&R)[9]) {
  for (int row = 0; row < 9; row += 3)
    for (int column = 0; column < 3; ++column) {
      const V squared =
          hn::MulAdd(T[row + 2], T[6 + column], hn::MulAdd(T[row + 1], T[3 + column], hn::Mul(T[row], T[column])));
      const V value = hn::MulAdd(f.a, squared, hn::Mul(f.b, T[row + column]));
      R[row + column] = row == 3 * column ? hn::Add(value, f.c) : value;
    }
}

HWY_INLINE V squared_norm(const V (&T)[9]) {
  V sum = square(T[0]);
  for (int i = 1; i < 9; ++i) sum = hn::MulAdd(T[i], T[i], sum);
  return sum;
}

/// Squared norms of the symmetric and of the antisymmetric part.
struct Parts {
  V symmetric, antisymmetric;
};

HWY_INLINE Parts parts(const V (&T)[9]) {
  V even = hn::Zero(D()), odd = hn::Zero(D());
  for (const int row : {0, 1})
    for (int column = row + 1; column < 3; ++column) {
      const V a = T[3 * row + column], b = T[3 * column + row];
      even = hn::Add(even, square(hn::Add(a, b)));
      odd = hn::Add(odd, square(hn::Sub(a, b)));
    }
  const V along = hn::MulAdd(T[8], T[8], hn::MulAdd(T[4], T[4], square(T[0])));
  return {hn::MulAdd(set(0.5), even, along), hn::Mul(set(0.5), odd)};
}

HWY_INLINE V erased(const V (&before)[9], const V (&after)[9]) {
  const Parts old = parts(before), kept = parts(after);
  const V zero = hn::Zero(D());
  return hn::Add(hn::Max(zero, hn::Sub(old.symmetric, kept.symmetric)),
                 hn::Max(zero, hn::Sub(old.antisymmetric, kept.antisymmetric)));
}

/// What is computed of tensors that are not symmetric; sets which of them are left, and which are on the cut.
HWY_INLINE Polynomial of_general(const Cubic& cubic, const RealRoots& roots, const Polynomial& real, bool positive,
                                 M& is_left, M& on_cut) {
  const V zero = hn::Zero(D());
  const V discriminant = hn::NegMulAdd(cubic.p, square(cubic.p), square(cubic.q));
  const M has_pair = hn::Gt(discriminant, zero);
  const V gap = hn::Min(hn::Sub(roots.high, roots.middle), hn::Sub(roots.middle, roots.low));
  const Pair complex = pair(cubic, discriminant);
  is_left = hn::Not(hn::Gt(select(has_pair, complex.beta, gap), set(apart)));
  const Polynomial result = select(has_pair, of_pair(complex, positive, on_cut), real);
  on_cut = hn::And(on_cut, has_pair);
  return result;
}

void compute(TensorVectors& tensors, int first, bool positive) {
  const D d;
  V before[9], T[9], R[9];
  for (int i = 0; i < 9; ++i) before[i] = hn::Load(d, tensors.tensor[i] + first);
  const V squares = squared_norm(before), norm = hn::Sqrt(squares);
  const V inverse = hn::Div(set(1), select(hn::Gt(norm, hn::Zero(d)), norm, set(1)));
  for (int i = 0; i < 9; ++i) T[i] = hn::Mul(before[i], inverse);
  const M symmetric = hn::And(hn::And(hn::Eq(T[1], T[3]), hn::Eq(T[2], T[6])), hn::Eq(T[5], T[7]));

  const Cubic cubic = characteristic_cubic(T);
  const RealRoots roots = real_roots(cubic);
  Polynomial f = absolute_of_real(roots);
  M is_left = hn::FirstN(d, 0), on_cut = is_left;
  if (!hn::AllTrue(d, symmetric)) {
    f = select(symmetric, f, of_general(cubic, roots, f, positive, is_left, on_cut));
    is_left = hn::AndNot(symmetric, is_left);
    on_cut = hn::AndNot(symmetric, on_cut);
  }
  evaluate(f, T, R);
  const M grows = hn::Not(hn::Le(squared_norm(R), set(max_growth * max_growth)));
  is_left = hn::Or(is_left, hn::AndNot(symmetric, grows));
  for (int i = 0; i < 9; ++i) {
    R[i] = hn::Mul(R[i], norm);
    hn::Store(R[i], d, tensors.result[i] + first);
  }
  hn::Store(squares, d, tensors.squared_norm + first);
  hn::Store(erased(before, R), d, tensors.erased + first);
  hn::Store(flag(on_cut), d, tensors.defective + first);
  hn::Store(flag(is_left), d, tensors.left + first);
}

}  // namespace

void compute_all(TensorVectors& tensors, int count, bool positive) {
  for (int first = 0; first < count; first += static_cast<int>(hn::Lanes(D()))) compute(tensors, first, positive);
}

}  // namespace HWY_NAMESPACE
}  // namespace tensorray
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tensorray {

HWY_EXPORT(compute_all);

void compute_with_eigenvalues(TensorVectors& tensors, int count, bool positive) {
  HWY_DYNAMIC_DISPATCH(compute_all)(tensors, count, positive);
}

}  // namespace tensorray
#endif
