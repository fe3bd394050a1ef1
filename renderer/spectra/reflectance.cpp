#include "renderer/spectra/reflectance.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>
#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The table has three cubes, one for each component that can be the largest. The axes of a cube are the largest
/// component, from `darkest` to 1, and the ratios of the other two components to it.
constexpr int table_nodes = 16;
/// A colour whose largest component is below this limit gets the spectrum of a brighter colour, scaled down: towards
/// black the coefficients grow without bound, while the shape of the spectrum no longer changes.
constexpr double grey_tolerance = 1e-6;
constexpr double darkest = 1.0 / 32;

constexpr double tolerance = 1e-9;   ///< Colours that differ by less are equal.
constexpr double noticeable = 1e-6;  ///< A larger difference makes a second search worthwhile.
constexpr double largest_coefficient = 1e5;

/// Maps 380 to 730 nm to −1 to 1, so that the three coefficients have similar sizes.
double position(double wavelength) { return (wavelength - 555) / 175; }

/// Maps space to the unit ball: c / √(1 + |c|²). For a constant spectrum the result is linear in the value of the
/// spectrum. The coefficients of dark and saturated colours grow without bound; here they become points near the
/// surface of the ball. For both reasons coefficients are interpolated in the ball.
Vector3d to_ball(const Vector3d& coefficients) { return coefficients / std::sqrt(1 + coefficients.squaredNorm()); }

Vector3d from_ball(const Vector3d& place) {
  constexpr double least = 1 / (largest_coefficient * largest_coefficient);
  return place / std::sqrt(std::max(1 - place.squaredNorm(), least));
}

/// Coefficients, and the colour that they produce.
struct Fit {
  Vector3d coefficients, residual;  ///< The residual is the produced colour minus the wanted one.
  Matrix3d jacobian;                ///< Derivative of the residual by the coefficients.
  double error = 0;                 ///< |residual|²
};

Fit evaluate(const std::vector<BandColor>& bands, const Vector3d& rgb, const Vector3d& coefficients) {
  Vector3d sum = -rgb, by_constant = Vector3d::Zero(), by_linear = Vector3d::Zero(), by_square = Vector3d::Zero();
  for (const BandColor& band : bands) {
    const double x = band.position, y = coefficients[0] + x * (coefficients[1] + x * coefficients[2]);
    const double cosine = 1 / std::sqrt(1 + y * y);
    sum += (0.5 + 0.5 * y * cosine) * band.color;
    const Vector3d slope = (0.5 * cosine * cosine * cosine) * band.color;
    by_constant += slope;
    by_linear += x * slope;
    by_square += (x * x) * slope;
  }
  Fit fit{coefficients, sum, Matrix3d(), sum.squaredNorm()};
  fit.jacobian << by_constant, by_linear, by_square;
  return fit;
}

/// The coefficients after one Levenberg step. With few bands the colour does not determine all coefficients; the
/// undetermined ones hardly change. The result is NaN if no coefficient affects the colour.
Vector3d step(const Fit& fit, double damping) {
  const Matrix3d& jacobian = fit.jacobian;
  Matrix3d normal = jacobian.transpose() * jacobian;
  normal.diagonal().array() += damping * normal.trace();
  const Vector3d next = fit.coefficients - normal.inverse() * (jacobian.transpose() * fit.residual);
  const double size = next.norm();
  return size > largest_coefficient ? Vector3d(next * (largest_coefficient / size)) : next;
}

/// Minimises the error from `start` until the colour is met, the error no longer decreases, or `step_limit` steps are
/// done. With enough bands the only local minima are at the border of the colours that reflectances can have: two of
/// these spectra cross at most twice, but two spectra of the same colour must cross more often, because the locus of
/// spectral colours is convex. So each colour has one spectrum, and the Jacobian is regular everywhere.
Fit descend(const std::vector<BandColor>& bands, const Vector3d& rgb, const Vector3d& start) {
  constexpr int step_limit = 60;
  constexpr double min_damping = 1e-14, first_damping = 1e-8, undamped = 1e-6, max_damping = 1e6, min_gain = 1e-3;
  Fit best = evaluate(bands, rgb, start);
  double damping = min_damping;
  for (int i = 0; i < step_limit && best.error > tolerance * tolerance && damping < max_damping; ++i) {
    const Fit next = evaluate(bands, rgb, step(best, damping));
    if (next.error < best.error) {
      const bool stalled = damping < undamped && next.error > (1 - min_gain) * best.error;
      best = next;
      damping = std::max(damping / 100, min_damping);
      if (stalled) break;
    } else {
      damping = std::max(damping * 30, first_damping);
    }
  }
  return best;
}

/// Goes from grey to the colour in steps and solves for each. It is slow, but converges with few bands, too.
Fit march(const std::vector<BandColor>& bands, const Vector3d& rgb) {
  constexpr int parts = 8;
  const Vector3d grey = Vector3d::Constant(0.5);
  Fit fit = descend(bands, grey, Vector3d::Zero());
  for (int i = 1; i <= parts; ++i) fit = descend(bands, grey + (rgb - grey) * i / parts, fit.coefficients);
  return fit;
}

Vector3d solve(const std::vector<BandColor>& bands, const Vector3d& rgb, const Vector3d& start) {
  const Fit fit = descend(bands, rgb, start);
  if (fit.error <= noticeable * noticeable) return fit.coefficients;
  const Fit other = march(bands, rgb);
  return other.error < fit.error ? other.coefficients : fit.coefficients;
}

std::size_t table_index(int largest, int brightness, int second, int third) {
  return ((static_cast<std::size_t>(largest) * table_nodes + brightness) * table_nodes + second) * table_nodes + third;
}

std::vector<Vector3d> make_table(const std::vector<BandColor>& bands) {
  constexpr int last = table_nodes - 1;
  std::vector<Vector3d> table(table_index(3, 0, 0, 0));
  tbb::parallel_for(0, 3 * table_nodes, [&](int layer) {
    const int largest = layer / table_nodes, i = layer % table_nodes;
    for (int j = 0; j <= last; ++j)
      for (int k = 0; k <= last; ++k) {
        Vector3d rgb;
        rgb[largest] = darkest + (1 - darkest) * i / last;
        rgb[(largest + 1) % 3] = rgb[largest] * j / last;
        rgb[(largest + 2) % 3] = rgb[largest] * k / last;
        table[table_index(largest, i, j, k)] = to_ball(solve(bands, rgb, Vector3d::Zero()));
      }
  });
  return table;
}

/// Approximate coefficients of a colour whose largest component is within [darkest, 1].
Vector3d interpolate(const std::vector<Vector3d>& table, const Vector3d& rgb) {
  int largest = 0;
  const double brightness = rgb.maxCoeff(&largest);
  std::array<double, 3> weight{(brightness - darkest) / (1 - darkest), rgb[(largest + 1) % 3] / brightness,
                               rgb[(largest + 2) % 3] / brightness};
  std::array<int, 3> node{};
  for (int axis = 0; axis < 3; ++axis) {
    weight[axis] *= table_nodes - 1;
    node[axis] = std::clamp(static_cast<int>(weight[axis]), 0, table_nodes - 2);
    weight[axis] -= node[axis];
  }
  Vector3d place = Vector3d::Zero();
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k)
        place += (i ? weight[0] : 1 - weight[0]) * (j ? weight[1] : 1 - weight[1]) * (k ? weight[2] : 1 - weight[2]) *
                 table[table_index(largest, node[0] + i, node[1] + j, node[2] + k)];
  return from_ball(place);
}

}  // namespace

double ReflectanceSpectrum::at(double wavelength) const {
  const double x = position(wavelength);
  const double y = coefficients[0] + x * (coefficients[1] + x * coefficients[2]);
  return scale * (0.5 + 0.5 * y / std::sqrt(1 + y * y));
}

ReflectanceModel::ReflectanceModel(const std::vector<Band>& bands, const Matrix3d& xyz_to_rgb) {
  if (bands.empty()) throw std::invalid_argument("a light without bands shows no colours; give it at least one band");
  for (const Band& band : bands) bands_.push_back({position(band.wavelength), xyz_to_rgb * band.xyz});
  table_ = make_table(bands_);
}

ReflectanceSpectrum ReflectanceModel::spectrum(const Vector3d& rgb) const {
  if (!rgb.allFinite()) return {{}, 0};
  const Vector3d color = rgb.cwiseMax(0);
  const double brightness = color.maxCoeff();
  // Filtering a grey picture in single precision makes small differences between channels; the result is still grey.
  if (color.minCoeff() >= (1 - grey_tolerance) * brightness) return {{}, 2 * color.mean()};  // σ(0) = ½
  const double scale = brightness > 1 ? brightness : brightness < darkest ? brightness / darkest : 1;
  const Vector3d reflectance = color / scale;
  const Vector3d coefficients = solve(bands_, reflectance, interpolate(table_, reflectance));
  return {{coefficients[0], coefficients[1], coefficients[2]}, scale};
}

}  // namespace tensorray
