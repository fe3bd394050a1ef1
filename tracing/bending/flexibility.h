#pragma once
/// @file tracing/bending/flexibility.h
/// How strongly light of each wavelength bends: s(λ) = a + b λ (Zheng and Pang 2003, Eq. 6).

namespace tensorray {

struct Flexibility {
  double a = 0.75;
  double b = -0.001;  ///< 1/nm.

  double at(double wavelength) const { return a + b * wavelength; }
};

}  // namespace tensorray
