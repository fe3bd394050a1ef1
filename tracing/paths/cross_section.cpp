#include "tracing/paths/cross_section.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "base/geometry/box.h"
#include "renderer/surfaces/plate.h"

namespace tensorray {
namespace {

constexpr double negligible = 1e-6;  // In units of ‖T‖: above the rounding of fields in single precision.

using Basis = Eigen::Matrix<double, 3, 2>;

/// An orthonormal basis of the plane normal to a unit vector.
Basis plane_basis(const Eigen::Vector3d& normal) {
  Basis basis;
  basis.col(0) = normal.unitOrthogonal();
  basis.col(1) = normal.cross(basis.col(0));
  return basis;
}

/// An orthonormal basis of the plane in which the circle C lies.
Basis circle_basis(const Eigen::Matrix3d& T, const Eigen::Vector3d& V) {
  const Eigen::Vector3d normal = T.transpose() * V;
  if (normal.norm() > negligible * T.norm()) return plane_basis(normal.normalized());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> stretches;
  stretches.computeDirect(T.transpose() * T);
  return stretches.eigenvectors().rightCols<2>();
}

// Where the limits begin to bend sizes, as parts of the greatest and of the least one.
constexpr double bent_from = 0.6, bent_to = 1.25;

/// `length`, or nearly `least` where it is less: from 0 to `least` + `width` it bends, without a jump of curvature.
double raised(double length, double least, double width) {
  if (length >= least + width) return length;
  if (length <= least - width) return least;
  const double u = 1 + (length - least) / width;
  return least + width / 16 * u * u * u * (4 - u);
}

/// `size`, or less above `knee`, and always less than `greatest`. Its curvature has no jump.
double lowered(double size, double knee, double greatest) {
  if (size <= knee) return size;
  return knee + (greatest - knee) * ((size - knee) / std::hypot(size - knee, greatest - knee));
}

/// Nearly the longer semi-axis, but without a corner where the axes change places.
double size_of(double longer, double shorter) {
  return longer > 0 ? longer * std::pow(1 + std::pow(shorter / longer, 4), 0.25) : 0;
}

/// An ellipse within the limits: unit semi-axes and their lengths, the longer one first. The limits are a little soft,
/// as corners of these functions would be corners of a tube's outline.
struct Clamped {
  Eigen::Vector3d major, minor;
  double major_length, minor_length;
};

Clamped clamped(const Basis& axes, const Eigen::Vector3d& V, const CrossSectionSettings& settings) {
  const double longer = settings.scale * axes.col(0).norm(), shorter = settings.scale * axes.col(1).norm();
  const double least = settings.min_radius, greatest = settings.max_radius, size = size_of(longer, shorter);
  const double shrink = size > 0 ? lowered(size, std::max(least, bent_from * greatest), greatest) / size : 1;
  const double width = std::min((bent_to - 1) * least, (greatest - least) / 2);
  Clamped result;
  const Eigen::Vector3d across = axes.col(0) - V.dot(axes.col(0)) * V;
  // An ellipse of size zero becomes a circle, of which any diameter is an axis.
  result.major = across.norm() > 0 ? Eigen::Vector3d(across.normalized()) : upright(V, Eigen::Vector3d::UnitY());
  result.minor = V.cross(result.major);
  result.major_length = raised(shrink * longer, least, width);
  result.minor_length = raised(shrink * shorter, least, width);
  return result;
}

void check(const CrossSectionSettings& settings) {
  if (!(settings.scale > 0)) throw std::invalid_argument("the scale of cross sections must be positive");
  if (!(settings.min_radius > 0)) throw std::invalid_argument("the least radius of cross sections must be positive");
  if (!(settings.max_radius >= settings.min_radius))
    throw std::invalid_argument("the greatest radius of cross sections must not be below the least");
}

}  // namespace

Basis ellipse(const Eigen::Matrix3d& tensor, const Eigen::Vector3d& direction) {
  const double norm = tensor.norm();
  if (!(norm > 0)) return Basis::Zero();
  // Works in the plane normal to V, so that rounding does not tilt the axes, and with T scaled to norm one, so that
  // squares do not overflow.
  const Eigen::Matrix3d T = tensor / norm;
  const Basis plane = plane_basis(direction);
  const Eigen::Matrix2d image = plane.transpose() * T * circle_basis(T, direction);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> stretches;
  stretches.computeDirect(image * image.transpose());
  Basis axes;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d axis = stretches.eigenvectors().col(1 - i);
    axes.col(i) = norm * (image.transpose() * axis).norm() * (plane * axis);
  }
  return axes;
}

Eigen::Vector3d transported(const Eigen::Vector3d& normal, const Eigen::Vector3d& from_position,
                            const Eigen::Vector3d& from_direction, const Eigen::Vector3d& to_position,
                            const Eigen::Vector3d& to_direction) {
  const auto reflected = [](const Eigen::Vector3d& vector, const Eigen::Vector3d& mirror) -> Eigen::Vector3d {
    return vector - 2 * mirror.dot(vector) / mirror.squaredNorm() * mirror;
  };
  const Eigen::Vector3d chord = to_position - from_position;
  Eigen::Vector3d carried;
  if (chord.dot(from_direction) > 0 && chord.dot(to_direction) > 0) {
    // The second mirror maps the reflected direction to the next one. These two directions are never close here.
    const Eigen::Vector3d mirror = to_direction - reflected(from_direction, chord);
    carried = reflected(reflected(normal, chord), mirror);
  } else {
    carried = turn_between(from_direction, to_direction) * normal;
  }
  return (carried - carried.dot(to_direction) * to_direction).normalized();
}

std::vector<CrossSection> cross_sections(const PathPoints& points, const CrossSectionSettings& settings) {
  check(settings);
  std::vector<CrossSection> sections;
  sections.reserve(points.size());
  Eigen::Vector3d frame = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& V = points[i].direction;
    Clamped e = clamped(ellipse(points[i].tensor, V), V, settings);
    if (i == 0) {
      frame = axis = e.major;
    } else {
      const auto carry = [&](const Eigen::Vector3d& normal) {
        return transported(normal, points[i - 1].position, points[i - 1].direction, points[i].position, V);
      };
      frame = carry(frame);
      axis = carry(axis);
    }
    if (e.major_length - e.minor_length <= negligible * e.major_length) e.major = axis;  // A circle.
    if (e.major.dot(axis) < 0) e.major = -e.major;
    e.minor = V.cross(e.major);
    axis = e.major;
    const Eigen::Matrix3d shape =
        e.major_length * e.major * e.major.transpose() + e.minor_length * e.minor * e.minor.transpose();
    sections.push_back(
        {e.major_length * e.major, e.minor_length * e.minor, shape * frame, shape * Eigen::Vector3d(V.cross(frame))});
  }
  return sections;
}

double scale_for_radius(const std::vector<const PathPoints*>& paths, double radius) {
  std::vector<std::vector<double>> of_paths(paths.size());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t path) {
    for (const PathPoint& point : *paths[path]) {
      if (!point.in_field) continue;
      const Basis axes = ellipse(point.tensor, point.direction);
      for (int i = 0; i < 2; ++i)
        if (const double length = axes.col(i).norm(); length > 0) of_paths[path].push_back(length);
    }
  });
  std::vector<double> lengths;
  for (const std::vector<double>& of_path : of_paths) lengths.insert(lengths.end(), of_path.begin(), of_path.end());
  if (lengths.empty()) return 1;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return radius / *middle;
}

}  // namespace tensorray
