#pragma once
/// @file tools/import/lattices/fill_values.h
/// Finds the numbers that programs write where they have no data.

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tensorray {

/// Whether a tensor or a vector is such a value: a component of 1e18 or more (1e20, 1e30, netCDF's 9.97e36, the
/// greatest float: also weighted by interpolation); or all components are one whole number of nines (-999, -9999, ...)
/// or the least integer of 16 or 32 bits.
inline bool is_fill_value(const double* components, int count) {
  const double size = std::abs(components[0]), power = std::round(std::log10(size + 1));
  if (std::any_of(components, components + count, [](double c) { return std::isfinite(c) && std::abs(c) >= 1e18; }))
    return true;
  const auto is_near = [size](double value) { return std::abs(size - value) <= 1e-6 * value; };
  const bool is_known = (power >= 3 && is_near(std::pow(10, power) - 1)) || is_near(0x1p15) || is_near(0x1p31);
  return is_known && std::all_of(components, components + count, [&](double c) { return is_near(std::abs(c)); });
}

struct FillValues {
  std::size_t count = 0;
  double example = 0;

  void add(const double* components, int size) {
    if (!is_fill_value(components, size)) return;
    ++count;
    example =
        *std::max_element(components, components + size, [](double a, double b) { return std::abs(a) < std::abs(b); });
  }
};

}  // namespace tensorray
