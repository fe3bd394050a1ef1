#pragma once
/// with_eigenvalues of eigenvalues.h for many tensors at once, in the widest vectors of the processor.

namespace tensorray {

/// Eigenvalues that are closer than this to each other count as equal, and those that are closer to an axis of the
/// complex plane count as on it. Relative to the Frobenius norm. Fields are in single precision, so that smaller
/// differences are noise.
constexpr double eigenvalue_tolerance = 1e-6;

/// Near a nilpotent Jordan block of three rows |·| has no limit and may grow as 1/|λ|. A result whose norm is more than
/// this multiple of the tensor's norm fades to zero, which is the value on the block itself.
constexpr double max_growth = 4;

/// Tensors side by side, component by component. (|T|ᵀ = |Tᵀ|, so that rows and columns may change places.)
struct TensorVectors {
  static constexpr int capacity = 64;
  using PerTensor = double[capacity];

  alignas(64) PerTensor tensor[9];  ///< Values of single precision; all are finite, also those that are not used.

  // Set by `with_eigenvalues`:
  alignas(64) PerTensor result[9];
  alignas(64) PerTensor squared_norm;  ///< Of the tensor.
  alignas(64) PerTensor erased;        ///< erased_norm of the tensor and the result.
  alignas(64) PerTensor defective;     ///< 1: a limit was taken; else 0.
  alignas(64) PerTensor left;          ///< 1: not computed, so that the caller must; else 0.
};

/// The function of eigenvalues.h, as a T² + b T + c I, with an error below 1e-9 of the tensor's norm. It leaves out
/// tensors that are not symmetric and have eigenvalues near each other, or whose result fades to zero: rounding errors
/// of closed forms would show there.
/// @param count     Number of tensors, from the first on; at most `capacity`.
/// @param positive  Whether to compute `positive`, else `absolute`.
void compute_with_eigenvalues(TensorVectors& tensors, int count, bool positive);

}  // namespace tensorray
