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

/// What elements behind the specimen show, by a row of their matrix.
Analysis analysis(const Arrangement& arrangement, double wavelength, const Eigen::RowVector4d& row) {
  const bool is_polarized = last_polarizer(arrangement.before) || last_polarizer(arrangement.after);
  const double greatest = is_polarized ? 0.5 : 1;  // Of parallel polarisers.
  const Eigen::Vector4d in = mueller_matrix(arrangement.before, wavelength).col(0) / greatest;
  return {in[0] * row[0], row.tail<3>().transpose() * in.tail<3>().transpose()};
}

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
  return analysis(arrangement, wavelength, mueller_matrix(arrangement.after, wavelength).row(0));
}

std::array<Analysis, 4> stokes_of(const Arrangement& arrangement, double wavelength) {
  std::vector<Element> kept = arrangement.after;
  if (const Element* const last = last_polarizer(kept)) kept.erase(kept.begin() + (last - kept.data()));
  const Matrix4d after = mueller_matrix(kept, wavelength);
  const auto parameter = [&](int i) { return analysis(arrangement, wavelength, (i == 3 ? -1 : 1) * after.row(i)); };
  return {parameter(0), parameter(1), parameter(2), parameter(3)};
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
