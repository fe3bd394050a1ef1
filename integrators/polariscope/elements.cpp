#include "integrators/polariscope/elements.h"

#include <array>
#include <cmath>
#include <complex>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Matrix2cd;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

double radians(double degrees) { return degrees * pi / 180; }

/// The identity, then Pauli's matrices, of which the second is diagonal.
const std::array<Matrix2cd, 4>& pauli() {
  static const std::array<Matrix2cd, 4> matrices = [] {
    const std::complex<double> i(0, 1);
    std::array<Matrix2cd, 4> m;
    m[0] = Matrix2cd::Identity();
    m[1] << 1, 0, 0, -1;
    m[2] << 0, 1, 1, 0;
    m[3] << 0, -i, i, 0;
    return m;
  }();
  return matrices;
}

Matrix2cd jones_of(const Element& element, double wavelength) {
  const double at = radians(element.angle);
  if (element.kind == ElementKind::polarizer) {
    const Vector2d axis(std::cos(at), std::sin(at));
    return (axis * axis.transpose()).cast<std::complex<double>>();
  }
  const double phase = element.kind == ElementKind::quarter_wave ? pi / 2 : 2 * pi * element.retardation / wavelength;
  const std::complex<double> turn(0, std::sin(phase / 2));
  return std::cos(phase / 2) * pauli()[0] + turn * (std::cos(2 * at) * pauli()[1] + std::sin(2 * at) * pauli()[2]);
}

/// What a Jones matrix does to (S0, S1, S2, −S3).
Matrix4d mueller_matrix(const Matrix2cd& jones) {
  Matrix4d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      result(row, column) =
          (pauli()[static_cast<std::size_t>(row)] * jones * pauli()[static_cast<std::size_t>(column)] * jones.adjoint())
              .trace()
              .real() /
          2;
  return result;
}

/// An angle plus a multiple of π, between −π/2 and π/2.
double half_turn(double angle) { return angle - pi * std::round(angle / pi); }

}  // namespace

std::optional<std::size_t> last_polarizer(const std::vector<Element>& elements) {
  for (std::size_t i = elements.size(); i-- > 0;)
    if (elements[i].kind == ElementKind::polarizer) return i;
  return std::nullopt;
}

Arrangement turned(Arrangement arrangement, double angle, double analyzer) {
  if (const auto last = last_polarizer(arrangement.after)) arrangement.after[*last].angle += analyzer;
  for (std::vector<Element>* elements : {&arrangement.before, &arrangement.after})
    for (Element& element : *elements) element.angle += angle;
  return arrangement;
}

Matrix2cd jones_matrix(const std::vector<Element>& elements, double wavelength) {
  Matrix2cd product = Matrix2cd::Identity();
  for (const Element& element : elements) product = jones_of(element, wavelength) * product;
  return product;
}

Analysis analysis_of(const Arrangement& arrangement, double wavelength) {
  const Matrix4d before = mueller_matrix(jones_matrix(arrangement.before, wavelength));
  const Matrix4d after = mueller_matrix(jones_matrix(arrangement.after, wavelength));
  const Vector3d in = before.block<3, 1>(1, 0), out = after.block<1, 3>(0, 1).transpose();
  const auto last = last_polarizer(arrangement.after);
  const double greatest = last || last_polarizer(arrangement.before) ? 0.5 : 1;  // Of parallel polarisers.
  Analysis analysis;
  analysis.through = before(0, 0) * after(0, 0) / greatest;
  analysis.by_rotation = out * in.transpose() / greatest;

  std::vector<Element> kept = arrangement.after;
  if (last) kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(*last));
  analysis.source = before(0, 0);
  analysis.polarized = in;
  analysis.to_stokes = mueller_matrix(jones_matrix(kept, wavelength)) / greatest;
  analysis.to_stokes.row(3) *= -1;
  return analysis;
}

EquivalentRetarder equivalent_retarder(const Eigen::Quaterniond& unitary) {
  Eigen::Quaterniond q = unitary;
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // The same matrix, but for the common phase.
  EquivalentRetarder result;
  result.phase = 2 * std::atan2(std::hypot(q.x(), q.y()), std::hypot(q.w(), q.z()));
  result.rotation = std::atan2(q.z(), q.w());
  result.azimuth = half_turn((std::atan2(q.y(), q.x()) + result.rotation) / 2);
  return result;
}

}  // namespace tensorray
