#include "renderer/color/transfer_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tensorray {

float TransferCurve::at(float x) const {
  if (!table.empty()) {
    const double place = std::clamp(static_cast<double>(x), 0.0, 1.0) * static_cast<double>(table.size() - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(place), table.size() - 2);
    const double part = place - static_cast<double>(i);
    return static_cast<float>((1 - part) * table[i] + part * table[i + 1]);
  }
  if (x < 0 && c == 0 && d <= 0) return -at(-x);
  const double value = x >= d ? std::pow(std::max(0.0, a * x + b), g) + e : c * x + f;
  return static_cast<float>(value);
}

TransferCurve srgb_curve() {
  TransferCurve curve;
  curve.g = 2.4;
  curve.a = 1 / 1.055;
  curve.b = 0.055 / 1.055;
  curve.c = 1 / 12.92;
  curve.d = 0.04045;
  return curve;
}

TransferCurve power_curve(double gamma) {
  TransferCurve curve;
  curve.g = gamma;
  return curve;
}

}  // namespace tensorray
