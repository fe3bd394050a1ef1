#include "integrators/polariscope/elements.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

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

}  // namespace

const std::vector<NamedArrangement>& named_arrangements() {
  const auto P = [](double angle) { return Element{ElementKind::polarizer, angle}; };
  const auto quarter = [](double angle) { return Element{ElementKind::quarter_wave, angle}; };
  static const std::vector<NamedArrangement> all{{"circular", {{P(0), quarter(45)}, {quarter(-45), P(90)}}},
                                                 {"circular_light", {{P(0), quarter(45)}, {quarter(-45), P(0)}}},
                                                 {"plane", {{P(0)}, {P(90)}}},
                                                 {"plane_light", {{P(0)}, {P(0)}}},
                                                 {"tint", {{P(0), {ElementKind::retarder, 45, 550}}, {P(90)}}}};
  return all;
}

const Element* last_polarizer(const std::vector<Element>& elements) {
  const auto found = std::find_if(elements.rbegin(), elements.rend(),
                                  [](const Element& each) { return each.kind == ElementKind::polarizer; });
  return found == elements.rend() ? nullptr : &*found;
}

Arrangement turned(Arrangement arrangement, double angle, double analyzer) {
  const Element* const last = last_polarizer(arrangement.after);
  for (std::vector<Element>* elements : {&arrangement.before, &arrangement.after})
    for (Element& element : *elements) element.angle += &element == last ? angle + analyzer : angle;
  return arrangement;
}

MeanLight light_of(const Eigen::Quaterniond& unitary) {
  MeanLight light = MeanLight::Ones();
  Eigen::Map<RowMatrix3d>(light.data()) = unitary.toRotationMatrix();
  return light;
}

std::array<MeanLight, 5> analyses_of(const Arrangement& arrangement, double wavelength) {
  const Element* const last = last_polarizer(arrangement.after);
  const double greatest = last || last_polarizer(arrangement.before) ? 0.5 : 1;  // Of parallel polarisers.
  const Eigen::Vector4d in = mueller_matrix(arrangement.before, wavelength).col(0) / greatest;
  std::vector<Element> others = arrangement.after;
  if (last) others.erase(others.begin() + (last - arrangement.after.data()));
  Eigen::Matrix<double, 5, 4> rows;
  rows << mueller_matrix(arrangement.after, wavelength).row(0), mueller_matrix(others, wavelength);
  rows.row(4) *= -1;
  std::array<MeanLight, 5> analyses;
  for (int i = 0; i < 5; ++i) {
    MeanLight& analysis = analyses[static_cast<std::size_t>(i)];
    Eigen::Map<RowMatrix3d>(analysis.data()) = rows.row(i).tail<3>().transpose() * in.tail<3>().transpose();
    analysis[9] = in[0] * rows(i, 0);
  }
  return analyses;
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
