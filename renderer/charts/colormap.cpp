#include "renderer/charts/colormap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace tensorray {
namespace {

/// Control points at equal distances, as hexadecimal sRGB with six digits per colour, in the order of the enumeration.
/// They are every fifth of the 256 colours of a published table. Exceptions: `twilight`, 52 colours chosen the same way
/// from a table of 510; and `cool_warm`, all 33 colours of its table. The header names the sources.
constexpr std::array<const char*, 7> tables{
    // viridis
    "44015446085c471063481769481d6f482475472a7a46307e453781433d844142873f48893d4e8a3a538b38598c355e8d33638d31688e"
    "2e6d8e2c718e2a768e297b8e27808e25848e23898e218e8d20928c1f978b1e9c891fa18821a58524aa8328ae802eb37c35b7793dbc74"
    "46c06f50c46a5ac86465cb5e70cf577cd25089d54895d840a2da37b0dd2fbddf26cae11fd8e219e5e419f1e51dfde725",
    // magma
    "00000402020b0504160907200e0b2b140e361a104221114e29115a311165390f6e420f754a107952137c5a167e6219806a1c81721f81"
    "792282812581892881912b81992d80a1307eaa337db2357bba3878c23b75ca3e72d2426fd9466be04c67e75263ec5860f1605df4695c"
    "f7725cf97b5dfb8560fc8e64fd9869fea16efeaa74feb47bfebd82fec68afecf92fed89afde2a3fdebacfcf4b6fcfdbf",
    // inferno
    "00000402020c0504170a072210092d160b391e0c45260c512f0a5b380962400a67490b6a510e6c59106e61136e69166e71196e781c6d"
    "801f6c88226a902568982766a02a63a82e5fb0315bb73557bf3952c63d4dcc4248d34743d94d3ddf5337e45a31e9612bed6925f1711f"
    "f47918f78212f98b0bfa9407fb9d07fca60cfcb014fbba1ffac42af8cd37f6d746f4e156f2ea69f2f27df5f992fcffa4",
    // plasma
    "0d08871b068d2605912f059638049a41049d4903a05102a35901a56100a76900a87100a87801a88004a88707a68e0ca49511a19c179e"
    "a21d9aa82296ae2892b42e8dba3388bf3984c43e7fc9447acd4a76d24f71d6556dda5b69de6164e26660e66c5ce97257ed7953f07f4f"
    "f3854bf58c46f79342f99a3efba139fca835fdaf31feb72dfebe2afdc627fcce25fbd724f8df25f6e826f3f027f0f921",
    // cividis
    "00224e002656002a5f002d68003070083370163770203a6f273e6e2e416d34456c3a486c3f4c6c444f6c49536c4e566c535a6d575d6d"
    "5c616e60646f656870696b716d6f727272747676767a7a787e7d788381798885788d8878928c789690779b9476a09875a59c74aaa073"
    "afa471b5a86fbaac6dbfb06bc4b468c9b965cfbd62d4c15fdac65bdfca57e5cf52ead34cf0d846f6dd3ffce236fee838",
    // cool_warm
    "3b4cc0445acc4d68d75775e16282ea6c8ef1779af782a5fb8db0fe98b9ffa3c2ffaec9fdb8d0f9c2d5f4ccd9eed5dbe6dddddde5d8d1"
    "ecd3c5f1ccb9f5c4adf7bba0f7b194f7a687f49a7bf18d6fec7f63e57058de604dd55042cb3e38c0282fb40426",
    // twilight
    "e2d9e2dcd9dfd2d5dbc5cfd5b6c8cfa7c0cb99b8c88cafc580a6c3779cc26f92c06888be647ebc6173ba6067b65f5cb25e50ac5e44a5"
    "5c389c5a2c915621835019734814623f125238114432123b32123739113a43123e4e14445b1749681a4d751e4f8224508d2b50973450"
    "a13e50a94850b05352b75f54bc6a59c1765fc48367c78f72ca9b7fcda78ed0b39ed4beafd9c8c0ddd0cfe0d7dbe2d9e2",
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
