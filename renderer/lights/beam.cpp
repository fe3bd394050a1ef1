#include "renderer/lights/beam.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/geometry/box.h"
#include "renderer/sampling/random.h"

namespace tensorray {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Andrew's monotone chain; the result is counter-clockwise, without collinear points.
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(),
            [](auto& a, auto& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); });
  std::vector<Eigen::Vector2d> hull;
  const auto extend = [&](const Eigen::Vector2d& point, std::size_t start) {
    while (hull.size() >= start + 2 && cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0)
      hull.pop_back();
    hull.push_back(point);
  };
  for (const Eigen::Vector2d& point : points) extend(point, 0);
  const std::size_t upper = hull.size() - 1;
  for (auto point = points.rbegin() + 1; point != points.rend(); ++point) extend(*point, upper);
  hull.pop_back();
  return hull;
}

/// Whether a point is inside a convex polygon or on its edge, to rounding.
bool contains(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& point) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& from = polygon[i];
    const Eigen::Vector2d edge = polygon[(i + 1) % polygon.size()] - from;
    if (cross(edge, point - from) < -1e-12 * edge.squaredNorm()) return false;
  }
  return true;
}

/// Unit; the mean direction from a source to points.
Eigen::Vector3d axis_from(const Eigen::Vector3d& source, const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d axis(0, 0, 0);
  for (const Eigen::Vector3d& point : points) axis += (point - source).normalized();
  return axis.normalized();
}

}  // namespace

double area(const std::vector<Eigen::Vector2d>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) twice += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return twice / 2;
}

Plate plate_across(const Beam& beam, double depth, int pixels) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : beam.aperture) box.extend(corner);
  Plate plate;
  plate.center = beam.start(box.center()) + depth * beam.direction;
  plate.right = beam.right;
  plate.up = beam.up;
  plate.size = box.sizes();
  plate.resolution = (pixels * plate.size / plate.size.maxCoeff()).array().round().max(1).matrix().cast<int>();
  return plate;
}

Beam silhouette_beam(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& direction,
                     const Eigen::Vector3d& up) {
  Beam beam;
  beam.direction = direction.normalized();
  beam.up = upright(beam.direction, up);
  beam.right = beam.direction.cross(beam.up);

  Eigen::AlignedBox3d box;  // In the frame (right, up, direction).
  std::vector<Eigen::Vector2d> seen;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p(point.dot(beam.right), point.dot(beam.up), point.dot(beam.direction));
    box.extend(p);
    seen.push_back(p.head<2>());
  }
  const Eigen::Vector2d middle = box.center().head<2>();
  for (Eigen::Vector2d& p : seen) p -= middle;
  beam.aperture = convex_hull(seen);
  const double size = box.diagonal().norm();
  if (!(area(beam.aperture) > 1e-12 * size * size))
    throw std::invalid_argument("seen along the light the volume has no area: choose another light direction");
  const double start = box.min().z() - 0.01 * size;
  beam.center = middle.x() * beam.right + middle.y() * beam.up + start * beam.direction;
  return beam;
}

Beam widened_beam(Beam beam, const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector2d> all = beam.aperture;
  for (const Eigen::Vector3d& point : points)
    all.emplace_back((point - beam.center).dot(beam.right), (point - beam.center).dot(beam.up));
  all = convex_hull(std::move(all));
  if (!(area(all) > (1 + 1e-9) * area(beam.aperture))) return beam;
  beam.core = std::exchange(beam.aperture, std::move(all));
  return beam;
}

bool is_surrounded(const Eigen::Vector3d& source, const std::vector<Eigen::Vector3d>& points) {
  constexpr double min_cosine = 0.02;
  const Eigen::Vector3d axis = axis_from(source, points);
  return std::any_of(points.begin(), points.end(), [&](const Eigen::Vector3d& point) {
    return !((point - source).dot(axis) > min_cosine * (point - source).norm());
  });
}

Beam point_beam(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& source) {
  constexpr double start_part = 1e-4;
  if (is_surrounded(source, points)) throw std::invalid_argument("the light is within the volume, or too near");
  Beam beam;
  beam.source = source;
  beam.direction = axis_from(source, points);
  beam.up = upright(beam.direction, Eigen::Vector3d::UnitZ());
  beam.right = beam.direction.cross(beam.up);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point : points) nearest = std::min(nearest, (point - source).dot(beam.direction));
  const double start = start_part * nearest;
  beam.center = source + start * beam.direction;
  std::vector<Eigen::Vector2d> seen;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d way = point - source;
    seen.push_back(start / way.dot(beam.direction) * Eigen::Vector2d(way.dot(beam.right), way.dot(beam.up)));
  }
  beam.aperture = convex_hull(seen);
  return beam;
}

double start_ratio(const Beam& beam, const Eigen::Vector3d& point) {
  if (!beam.source) return 1;
  const auto distance = [&](const Eigen::Vector3d& p) { return (p - *beam.source).dot(beam.direction); };
  return distance(beam.center) / std::max(distance(point), distance(beam.center));
}

/// The solid angle is that of van Oosterom and Strackee (1983).
double start_area(const Beam& beam, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  if (!beam.source) return std::abs(cross(b - a, c - a)) / 2;
  const auto direction = [&](const Eigen::Vector2d& across) { return beam.direction_at(beam.start(across)); };
  const Eigen::Vector3d A = direction(a), B = direction(b), C = direction(c);
  // Of differences, which keep the digits of small triangles.
  return 2 * std::atan2(std::abs(A.dot((B - A).cross(C - A))), 1 + A.dot(B) + B.dot(C) + C.dot(A));
}

BeamSampler::BeamSampler(const Beam& beam, BeamPattern pattern, std::uint64_t count, std::uint64_t seed)
    : beam_(beam), pattern_(pattern), seed_(seed) {
  if (count < 1) throw std::invalid_argument("a beam needs at least one photon");
  const Eigen::AlignedBox2d box = box_of(beam.aperture);
  corner_ = box.min();
  extent_ = box.sizes();
  const double rectangle = extent_.prod();
  const double wanted = static_cast<double>(count) * rectangle / area(beam.aperture);
  if (pattern == BeamPattern::grid || pattern == BeamPattern::stratified) {
    columns_ = std::max<std::uint64_t>(1, std::llround(std::sqrt(wanted * extent_.x() / extent_.y())));
    rows_ = std::max<std::uint64_t>(1, std::llround(wanted / static_cast<double>(columns_)));
    candidates_ = columns_ * rows_;
  } else {
    candidates_ = std::max<std::uint64_t>(1, std::llround(wanted));
  }
  if (pattern == BeamPattern::sobol && candidates_ > std::numeric_limits<std::uint32_t>::max())
    throw std::invalid_argument("the sobol pattern has at most 2^32 photons: choose the stratified pattern");
  area_per_candidate_ = rectangle / static_cast<double>(candidates_);
}

bool BeamSampler::sample(std::uint64_t index, Emission& emission) const {
  const Eigen::Vector3d u = unit_sample(index);
  const Eigen::Vector2d position = corner_ + u.head<2>().cwiseProduct(extent_);
  if (!contains(beam_.aperture, position)) return false;
  emission.origin = beam_.start(position);
  emission.across = u.head<2>();
  emission.stratum = u.z();
  return true;
}

Eigen::Vector3d BeamSampler::unit_sample(std::uint64_t index) const {
  const auto uniform = [&](std::uint32_t dimension) { return random_uniform(seed_, index, dimension); };
  if (pattern_ == BeamPattern::grid) return cell_sample(index, {0.5, 0.5});
  if (pattern_ == BeamPattern::stratified) return cell_sample(index, {uniform(0), uniform(1)});
  if (pattern_ == BeamPattern::random) return {uniform(0), uniform(1), uniform(2)};
  const auto i = static_cast<std::uint32_t>(index);
  return {sobol(seed_, i, 0), sobol(seed_, i, 1), sobol(seed_, i, 2)};
}

/// A position in a cell of a lattice. The stratum is a rank-1 lattice over the cells: cells with similar strata are
/// evenly spread. So the light of each wavelength is evenly spread, even if only some wavelengths start from each cell.
Eigen::Vector3d BeamSampler::cell_sample(std::uint64_t index, const Eigen::Vector2d& within) const {
  const auto column = static_cast<double>(index % columns_), row = static_cast<double>(index / columns_);
  constexpr double golden1 = 0.7548776662466927, golden2 = 0.5698402909980532;  // Roberts' R2 sequence.
  const double stratum = golden1 * column + golden2 * row + random_uniform(seed_, 0, 3);
  return {(column + within.x()) / static_cast<double>(columns_), (row + within.y()) / static_cast<double>(rows_),
          stratum - std::floor(stratum)};
}

}  // namespace tensorray
