#include "renderer/coverage/area_deposit.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr double unit = 281474976710656.0;  // 2^48: the sum for the power 1.
constexpr double min_area = 1e-6;           // Triangles of less area, pixels² for each pixel of length, become lines.
constexpr double max_sum = 1125899906842624.0;  // 2^50. If an edge may add more, too; see `integer_bits`.
constexpr double line_points = 4;               // Points of a line, for each pixel of its length.

/// The nearest integer; values of opposite signs cancel.
std::uint64_t integer(double value) {
  const double sum = value + integer_bits;
  std::uint64_t bits;
  std::memcpy(&bits, &sum, sizeof bits);
  return bits;
}

double twice_area_of(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d ab = b - a, ac = c - a;
  return ab.x() * ac.y() - ab.y() * ac.x();
}

bool is_line(const Vector2d& extent, double twice_area) {
  return std::abs(twice_area) < min_area * std::max(1.0, extent.sum());
}

/// Points with equal power of a triangle without area. The density along the line rises from one end of the longest
/// side to the third corner, and falls to the other end.
std::vector<Vector2d> points_of_line(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  Vector2d from = a, to = b, middle = c;
  if ((c - b).squaredNorm() > (to - from).squaredNorm()) from = b, to = c, middle = a;
  if ((a - c).squaredNorm() > (to - from).squaredNorm()) from = c, to = a, middle = b;
  const double length = (to - from).norm();
  const double peak = length > 0 ? std::clamp((middle - from).dot(to - from) / (length * length), 0.0, 1.0) : 0;
  const auto count = static_cast<int>(std::min(1e6, std::ceil(line_points * length))) + 1;
  std::vector<Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const double part = (i + 0.5) / count;
    const double t = part < peak ? std::sqrt(part * peak) : 1 - std::sqrt((1 - part) * (1 - peak));
    points.emplace_back(from + t * (to - from));
  }
  return points;
}

/// The part of a convex polygon where `sign` · coordinate >= `sign` · limit.
std::vector<Vector2d> cut(const std::vector<Vector2d>& polygon, int axis, double sign, double limit) {
  std::vector<Vector2d> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double from = sign * (a[axis] - limit), to = sign * (b[axis] - limit);
    if (from >= 0) part.push_back(a);
    if ((from < 0) != (to < 0)) part.emplace_back(a + from / (from - to) * (b - a));
  }
  return part;
}

}  // namespace

AreaDeposit::AreaDeposit(int width, int height, int first_row, int end_row)
    : width_(width), height_(height), first_row_(first_row), end_row_(end_row) {
  if (width < 1 || height < 1 || first_row < 0 || end_row <= first_row || end_row > height)
    throw std::invalid_argument("a plate needs at least one pixel");
  stride_ = static_cast<std::size_t>(width) + 3;
  sums_.resize(DepositPlanes::count * stride_ * static_cast<std::size_t>(end_row - first_row));
}

void AreaDeposit::set_plane_weights(const PlaneWeights& plane_weights) {
  if (plane_weights == plane_weights_) return;
  flush();
  plane_weights_ = plane_weights;
}

double AreaDeposit::triangle(const Vector2d& a, const Vector2d& b, const Vector2d& c, double power) {
  const Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  if (!(low.x() < width_ && low.y() < height_ && high.x() > 0 && high.y() > 0)) return 0;
  if (low.x() >= 0 && low.y() >= 0 && high.x() < std::floor(low.x()) + 1 && high.y() < std::floor(low.y()) + 1) {
    add_point(low, power);
    return 0;
  }
  const double twice_area = twice_area_of(a, b, c), density = -2 * unit * power / twice_area;
  if (!is_line(high - low, twice_area) && std::abs(density) <= max_sum) return density;
  const std::vector<Vector2d> points = points_of_line(a, b, c);
  for (const Vector2d& point : points) add_point(point, power / static_cast<double>(points.size()));
  return 0;
}

void AreaDeposit::add_point(const Vector2d& at, double power) {
  if (!is_on_plate(at, {width_, height_})) return;
  const int x = std::min(static_cast<int>(at.x()), width_ - 1), y = std::min(static_cast<int>(at.y()), height_ - 1);
  if (y < first_row_ || y >= end_row_) return;
  add_difference(x, y, unit * power, 0);
  add_difference(x + 1, y, 0, unit * power);
}

/// Left of the plate an edge counts as if it were on the border; right of it, it covers nothing.
void AreaDeposit::add_edge(const Vector2d& from, const Vector2d& to, double density) {
  for (const double border : {0.0, static_cast<double>(width_)}) {
    if ((from.x() < border) == (to.x() < border) || from.x() == border || to.x() == border) continue;
    const double part = (border - from.x()) / (to.x() - from.x());
    const Vector2d middle(border, from.y() + part * (to.y() - from.y()));
    add_edge(from, middle, density);
    return add_edge(middle, to, density);
  }
  if (from.x() >= width_ && to.x() >= width_) return;
  if (batch_.count == EdgeBatch::capacity) flush();
  batch_.from_x[batch_.count] = std::max(from.x(), 0.0);
  batch_.from_y[batch_.count] = from.y();
  batch_.to_x[batch_.count] = std::max(to.x(), 0.0);
  batch_.to_y[batch_.count] = to.y();
  batch_.density[batch_.count++] = density;
}

void AreaDeposit::flush() {
  deposit_edges(batch_, plane_weights_.data(), {sums_.data(), stride_, width_, first_row_, end_row_});
  batch_.count = 0;
}

void AreaDeposit::add(const std::vector<std::uint64_t>& sums) {
  if (sums.size() != sums_.size()) throw std::invalid_argument("light of another plate cannot be added");
  for (std::size_t i = 0; i < sums.size(); ++i) sums_[i] += sums[i];
}

void AreaDeposit::read_row(const std::vector<const AreaDeposit*>& deposits, int y, int plane, double* power) {
  const AreaDeposit& any = *deposits[0];
  std::uint64_t sum = 0;
  for (int x = 0; x < any.width_; ++x) {
    for (const AreaDeposit* deposit : deposits)
      sum += deposit->sums_[any.place(x, y) + static_cast<std::size_t>(plane)];
    power[x] = static_cast<double>(static_cast<std::int64_t>(sum)) / unit;
  }
}

void AreaDeposit::add_difference(int x, int y, double covered, double before) {
  std::uint64_t* const sums = &sums_[place(x, y)];
  for (std::size_t k = 0; k < plane_weights_.size(); ++k)
    sums[k] += integer(plane_weights_[k] * covered) - integer(plane_weights_[k] * before);
}

bool is_on_plate(const Vector2d& at, const Eigen::Vector2i& plate) {
  return at.x() >= 0 && at.y() >= 0 && at.x() <= plate.x() && at.y() <= plate.y();
}

double part_on_plate(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Eigen::Vector2i& plate) {
  if (is_on_plate(a, plate) && is_on_plate(b, plate) && is_on_plate(c, plate)) return 1;
  const Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  if (!(low.x() < plate.x() && low.y() < plate.y() && high.x() > 0 && high.y() > 0)) return 0;
  const double twice_area = twice_area_of(a, b, c);
  if (is_line(high - low, twice_area)) {
    const std::vector<Vector2d> points = points_of_line(a, b, c);
    const auto on_plate =
        std::count_if(points.begin(), points.end(), [&](const Vector2d& at) { return is_on_plate(at, plate); });
    return static_cast<double>(on_plate) / static_cast<double>(points.size());
  }
  std::vector<Vector2d> part{a, b, c};
  for (const int axis : {0, 1}) part = cut(cut(part, axis, 1, 0), axis, -1, plate[axis]);
  double twice = 0;
  for (std::size_t i = 1; i + 1 < part.size(); ++i) twice += twice_area_of(part[0], part[i], part[i + 1]);
  return std::clamp(twice / twice_area, 0.0, 1.0);
}

}  // namespace tensorray
