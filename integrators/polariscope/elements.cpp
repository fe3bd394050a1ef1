#include "integrators/polariscope/elements.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;

/// What elements do to (S0, S1, S2, −S3) of light of one wavelength (nm).
Matrix4d mueller_matrix(const std::vector<Element>& elements, double wavelength) {
  Matrix4d product = Matrix4d::Identity();
  for (const Element& element : elements) {
    const double twice = element.angle * pi / 90;
    const Vector3d axis(std::cos(twice), std::sin(twice), 0);
    const double phase = element.kind == ElementKind::quarter_wave ? pi / 2 : 2 * pi * element.retardation / wavelength;
    Matrix4d matrix = Matrix4d::Identity();
    if (element.kind == ElementKind::polarizer)
      matrix = Eigen::Vector4d(1, axis.x(), axis.y(), 0) * Eigen::RowVector4d(1, axis.x(), axis.y(), 0) / 2;
    else
      matrix.bottomRightCorner<3, 3>() = Eigen::AngleAxisd(-phase, axis).toRotationMatrix();
    product = matrix * product;
  }
  return product;
}

bool is_polarizer(const Element& element) { return element.kind == ElementKind::polarizer; }

}  // namespace

const Element* first_polarizer(const std::vector<Element>& elements) {
  const auto found = std::find_if(elements.begin(), elements.end(), is_polarizer);
  return found == elements.end() ? nullptr : &*found;
}

const Element* last_polarizer(const std::vector<Element>& elements) {
  const auto found = std::find_if(elements.rbegin(), elements.rend(), is_polarizer);
  return found == elements.rend() ? nullptr : &*found;
}

Arrangement turned(Arrangement arrangement, double angle, double analyzer) {
  const Element* const last = last_polarizer(arrangement.after);
  for (std::vector<Element>* elements : {&arrangement.before, &arrangement.after})
    for (Element& element : *elements) element.angle += &element == last ? angle + analyzer : angle;
  return arrangement;
}

Analysis analysis_of(const Arrangement& arrangement, double wavelength) {
  const Matrix4d before = mueller_matrix(arrangement.before, wavelength);
  const Matrix4d after = mueller_matrix(arrangement.after, wavelength);
  std::vector<Element> kept = arrangement.after;
  const Element* const last = last_polarizer(kept);
  const double greatest = last || last_polarizer(arrangement.before) ? 0.5 : 1;  // Of parallel polarisers.
  if (last) kept.erase(kept.begin() + (last - kept.data()));
  Analysis analysis;
  analysis.through = before(0, 0) * after(0, 0) / greatest;
  analysis.source = before(0, 0);
  analysis.polarized = before.block<3, 1>(1, 0);
  analysis.by_rotation = after.block<1, 3>(0, 1).transpose() * analysis.polarized.transpose() / greatest;
  analysis.to_stokes = mueller_matrix(kept, wavelength) / greatest;
  analysis.to_stokes.row(3) *= -1;
  return analysis;
}

EquivalentRetarder equivalent_retarder(const Eigen::Quaterniond& unitary) {
  Eigen::Quaterniond q = unitary;
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // The same matrix, but for the common phase.
  EquivalentRetarder result;
  result.phase = 2 * std::atan2(std::hypot(q.x(), q.y()), std::hypot(q.w(), q.z()));
  result.rotation = std::atan2(q.z(), q.w());
  const double azimuth = (std::atan2(q.y(), q.x()) + result.rotation) / 2;
  result.azimuth = azimuth - pi * std::round(azimuth / pi);
  return result;
}

}  // namespace tensorray
