#include "renderer/charts/colormap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace tensorray {
namespace {

/// Control points at equal distances, as hexadecimal sRGB with six digits per colour, in the order of the enumeration.
/// They are every fifth of the 256 colours of a published table. Exceptions: `twilight`, 52 colours chosen the same way
/// from a table of 510; and `cool_warm`, all 33 colours of its table. The header names the sources.
constexpr std::array<const char*, 7> tables{
#include "renderer/charts/colormaps.inc"
};

/// Control points, with one additional point at each end for the slopes there.
using Knots = std::vector<Eigen::Vector3d>;

Eigen::Vector3d colour_of(const std::string& digits) {
  const unsigned long value = std::stoul(digits, nullptr, 16);
  return Eigen::Vector3d(static_cast<double>(value >> 16), static_cast<double>(value >> 8 & 255),
                         static_cast<double>(value & 255)) /
         255;
}

Knots make_knots(const std::string& table, bool cyclic) {
  Knots knots(1);
  for (std::size_t i = 0; i < table.size(); i += 6) knots.push_back(colour_of(table.substr(i, 6)));
  const std::size_t last = knots.size() - 1;
  // The additional point continues the parabola through the last three: slopes at the ends are as accurate as inside.
  knots[0] = cyclic ? knots[last - 1] : Eigen::Vector3d(3 * (knots[1] - knots[2]) + knots[3]);
  knots.push_back(cyclic ? knots[2] : Eigen::Vector3d(3 * (knots[last] - knots[last - 1]) + knots[last - 2]));
  return knots;
}

const Knots& knots_of(Colormap map) {
  static const std::vector<Knots> all = [] {
    std::vector<Knots> made;
    for (const char* const table : tables)
      made.push_back(make_knots(table, made.size() == static_cast<std::size_t>(Colormap::twilight)));
    return made;
  }();
  return all.at(static_cast<std::size_t>(map));
}

/// A cubic Catmull-Rom spline.
Eigen::Vector3d interpolate(const Knots& knots, double x) {
  const std::size_t intervals = knots.size() - 3;
  const double scaled = x * static_cast<double>(intervals);
  const std::size_t i = std::min(static_cast<std::size_t>(scaled), intervals - 1);
  const double t = scaled - static_cast<double>(i), s = 1 - t;
  const Eigen::Vector3d &a = knots[i + 1], &b = knots[i + 2];
  const Eigen::Vector3d slope_a = (b - knots[i]) / 2, slope_b = (knots[i + 3] - a) / 2;
  return s * s * ((1 + 2 * t) * a + t * slope_a) + t * t * ((1 + 2 * s) * b - s * slope_b);
}

double to_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double to_linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

/// The luminance of CIE lightness L* = 100 x.
double grey_luminance(double x) {
  const double root = (100 * x + 16) / 116;
  return x > 0.08 ? root * root * root : x * 100 * 27 / 24389;
}

/// This order of min and max turns NaN into 0.
double clamped(double x) { return std::min(std::max(0.0, x), 1.0); }

/// Interpolates linearly between the ranks of sorted values.
double percentile(const std::vector<double>& sorted, double percent) {
  const double rank = percent / 100 * static_cast<double>(sorted.size() - 1);
  const std::size_t below = static_cast<std::size_t>(rank), above = std::min(below + 1, sorted.size() - 1);
  const double t = rank - static_cast<double>(below);
  return (1 - t) * sorted[below] + t * sorted[above];
}

/// Whether the two values are far enough apart, relative to rounding, for a scale between them.
bool is_wide(double low, double high) {
  return high - low > 1e-12 * std::max(std::abs(low), std::abs(high)) && std::isfinite(1 / (high - low));
}

ValueRange range_about(double value, bool logarithmic) {
  if (logarithmic) return {value / 2, 2 * value, true};
  const double margin = std::abs(value) / 2;
  return is_wide(value - margin, value + margin) ? ValueRange{value - margin, value + margin} : ValueRange{};
}

/// Removes values that the scale cannot show and sorts the rest.
void keep_sorted(std::vector<double>& values, bool logarithmic) {
  const auto is_left_out = [&](double value) { return !std::isfinite(value) || (logarithmic && value <= 0); };
  values.erase(std::remove_if(values.begin(), values.end(), is_left_out), values.end());
  std::sort(values.begin(), values.end());
}

void check(const RangeChoice& choice) {
  if (!(choice.low_percentile >= 0 && choice.low_percentile < choice.high_percentile && choice.high_percentile <= 100))
    throw std::invalid_argument("the percentiles of a range of values must rise, from 0 to 100");
  if (choice.symmetric && choice.logarithmic)
    throw std::invalid_argument("a logarithmic range of values cannot be symmetric: choose one of them");
}

}  // namespace

Eigen::Vector3d colormap_srgb(Colormap map, double x) {
  x = clamped(x);
  if (map == Colormap::grey) return Eigen::Vector3d::Constant(to_srgb(grey_luminance(x)));
  return interpolate(knots_of(map), x).cwiseMax(0).cwiseMin(1);
}

Eigen::Vector3d colormap_linear(Colormap map, double x) {
  if (map == Colormap::grey) return Eigen::Vector3d::Constant(grey_luminance(clamped(x)));
  return srgb_to_linear(colormap_srgb(map, x));
}

Eigen::Vector3d srgb_to_linear(const Eigen::Vector3d& srgb) { return srgb.unaryExpr(&to_linear); }

Eigen::Vector3d linear_to_srgb(const Eigen::Vector3d& linear) {
  return linear.cwiseMax(0).cwiseMin(1).unaryExpr(&to_srgb);
}

double ValueRange::position(double value) const {
  if (!logarithmic) return clamped((value - low) / (high - low));
  return value > 0 ? clamped(std::log(value / low) / std::log(high / low)) : 0;
}

double ValueRange::value(double position) const {
  return logarithmic ? low * std::pow(high / low, position) : low + position * (high - low);
}

ValueRange choose_range(std::vector<double> values, const RangeChoice& choice) {
  check(choice);
  keep_sorted(values, choice.logarithmic);
  ValueRange range = choice.logarithmic ? ValueRange{1, 10, true} : ValueRange{};
  if (!values.empty()) {
    const double low = percentile(values, choice.low_percentile), high = percentile(values, choice.high_percentile);
    if (is_wide(low, high))
      range = {low, high, choice.logarithmic};
    else if (is_wide(values.front(), values.back()))
      range = {values.front(), values.back(), choice.logarithmic};
    else
      range = range_about(values[values.size() / 2], choice.logarithmic);
  }
  if (choice.symmetric) {
    range.high = std::max(std::abs(range.low), std::abs(range.high));
    range.low = -range.high;
  }
  return range;
}

}  // namespace tensorray
