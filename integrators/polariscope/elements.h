#pragma once
/// The elements of a polariscope before and after the specimen, and the power that they let through.
/// Polarisation is in the frame (u, w) across the light, in which the picture is seen: u to the right, w up.

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tensorray {

enum class ElementKind { polarizer, quarter_wave, retarder };

struct Element {
  ElementKind kind = ElementKind::polarizer;
  double angle = 0;        ///< Of the polariser, or of the fast axis; degrees from u towards w.
  double retardation = 0;  ///< retarder: nm, of any wavelength. A quarter-wave plate is one at every wavelength.
};

/// Elements in the order of the light.
struct Arrangement {
  std::vector<Element> before, after;
};

/// The arrangements that have names in scene files; the first one is the default.
struct NamedArrangement {
  const char* name;
  Arrangement elements;
};
const std::vector<NamedArrangement>& named_arrangements();

/// The last polariser of a list; null if it has none.
const Element* last_polarizer(const std::vector<Element>& elements);

/// All elements turned by `angle`, and the last polariser by `analyzer` more; degrees.
Arrangement turned(Arrangement arrangement, double angle, double analyzer);

/// What a specimen does to polarisation is a unitary matrix, w I − i (x σ_z + y σ_x + z σ_y). That is the quaternion
/// (w, x, y, z); products of matrices are products of quaternions, and its rotation turns the vector (S1, S2, −S3) of
/// Stokes' parameters. S3 > 0 is light that turns clockwise for who faces it.
///
/// The mean light of many ways through a specimen, for its Mueller matrix: the nine components of the mean rotation R,
/// row by row, and the part of the light that nothing stops (of which R is a part, too).
using MeanLight = Eigen::Matrix<double, 10, 1>;

/// The light of one way.
MeanLight light_of(const Eigen::Quaterniond& unitary);

/// What is seen of light of one wavelength that comes in without polarisation: the products of each of these with
/// MeanLight are the power (1 is what parallel polarisers let through without a specimen), and Stokes' parameters S0 to
/// S3 of the light on the last polariser.
std::array<MeanLight, 5> analyses_of(const Arrangement& arrangement, double wavelength);

/// A unitary matrix as a rotation, then a linear retarder.
struct EquivalentRetarder {
  double phase = 0;     ///< From 0 to π.
  double azimuth = 0;   ///< Its slow axis: from u towards w, radians; −π/2 to π/2.
  double rotation = 0;  ///< The same sense; −π/2 to π/2.
};

EquivalentRetarder equivalent_retarder(const Eigen::Quaterniond& unitary);

}  // namespace tensorray
