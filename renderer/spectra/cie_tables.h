#pragma once
/// @file renderer/spectra/cie_tables.h
/// Published tables of the CIE (CIE 015).

#include <array>

namespace tensorray {

/// The CIE 1931 2° standard observer: (x̄, ȳ, z̄) from 360 to 830 nm, one entry per nanometre.
extern const std::array<double, 3 * 471> cie_1931_observer;

/// Relative spectral power of the standard illuminant D65, from 300 to 830 nm every 5 nm.
extern const std::array<double, 107> cie_d65;

}  // namespace tensorray
