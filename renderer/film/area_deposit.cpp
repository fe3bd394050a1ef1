#include "renderer/film/area_deposit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tensorray {
namespace {

constexpr double unit = 70368744177664.0;  // 2^46: the sum for the power 1.
constexpr double least_area = 1e-6;        // Triangles of less area, pixels² for each pixel of length, become lines.
constexpr double greatest_density = 1e18;  // Beyond this too; the sums of a pixel are 64-bit integers.
constexpr double line_points = 4;          // Points of a line, for each pixel of its length.

/// Rounds towards zero, so that values of opposite signs still cancel.
std::uint64_t quanta(double value) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(value)); }

}  // namespace

AreaDeposit::AreaDeposit(int width, int height) : width_(width), height_(height) {
  if (width < 1 || height < 1) throw std::invalid_argument("a plate needs at least one pixel");
  stride_ = static_cast<std::size_t>(width) + 2;
  sums_.resize(stride_ * static_cast<std::size_t>(height));
}

void AreaDeposit::clear() { std::fill(sums_.begin(), sums_.end(), Sum{0}); }

double AreaDeposit::triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                             double power) {
  const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  if (!(low.x() < width_ && low.y() < height_ && high.x() > 0 && high.y() > 0)) return 0;
  const Eigen::Vector2d ab = b - a, ac = c - a;
  const double twice_area = ab.x() * ac.y() - ab.y() * ac.x();
  if (low.x() >= 0 && low.y() >= 0 && high.x() < std::floor(low.x()) + 1 && high.y() < std::floor(low.y()) + 1) {
    add_point(low, power);
    return 0;
  }
  const double density = -2 * unit * power / twice_area;
  if (std::abs(twice_area) < least_area * std::max(1.0, (high - low).sum()) || std::abs(density) > greatest_density) {
    add_line(a, b, c, power);
    return 0;
  }
  return density;
}

void AreaDeposit::add_triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                               double power) {
  const double density = triangle(a, b, c, power);
  if (density == 0) return;
  add_edge(a, b, density);
  add_edge(b, c, density);
  add_edge(c, a, density);
}

void AreaDeposit::add_point(const Eigen::Vector2d& at, double power) {
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() <= width_ && at.y() <= height_)) return;
  const int x = std::min(static_cast<int>(at.x()), width_ - 1), y = std::min(static_cast<int>(at.y()), height_ - 1);
  const Sum sum = quanta(unit * power);
  row(y)[x] += sum;
  row(y)[x + 1] -= sum;
}

void AreaDeposit::read_row(int y, double* power) const {
  const Sum* sums = sums_.data() + static_cast<std::size_t>(y) * stride_;
  Sum sum = 0;
  for (int x = 0; x < width_; ++x) {
    sum += sums[x];
    power[x] = static_cast<double>(static_cast<std::int64_t>(sum)) / unit;
  }
}

void AreaDeposit::add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double density) {
  if (from.y() == to.y()) return;
  if (from.y() > to.y()) return add_edge(to, from, -density);
  const double slope = (to.x() - from.x()) / (to.y() - from.y()), end = std::min<double>(to.y(), height_);
  double y = std::max(from.y(), 0.0);
  for (int line = static_cast<int>(y); y < end; ++line) {
    const double next = std::min(line + 1.0, end);
    const double x = from.x() + (y - from.y()) * slope, next_x = from.x() + (next - from.y()) * slope;
    add_span(row(line), std::min(x, next_x), std::max(x, next_x), density * (next - y));
    y = next;
  }
}

/// Adds a part of an edge within a row. The part goes from column `left` to `right`; `weight` is the density times its
/// height. Left of the plate it counts as if it were on the border; right of it, it covers nothing.
void AreaDeposit::add_span(Sum* row, double left, double right, double weight) const {
  if (left >= 0 && right <= width_) return add_inner_span(row, left, right, weight);
  if (left >= width_) return;
  if (right <= 0) {
    row[0] += quanta(weight);
    return;
  }
  const double per_column = weight / (right - left);
  if (left < 0) {
    row[0] += quanta(-left * per_column);
    left = 0;
  }
  right = std::min<double>(right, width_);
  add_inner_span(row, left, right, (right - left) * per_column);
}

void AreaDeposit::add_inner_span(Sum* row, double left, double right, double weight) const {
  const int first = static_cast<int>(left);
  const double middle = (left + right) / 2;
  const Sum all = quanta(weight);
  if (right <= first + 1) {
    const Sum covered = quanta(weight * (first + 1 - middle));
    row[first] += covered;
    row[first + 1] += all - covered;
    return;
  }
  // The area to the left of column x that the edge covers is a parabola up to the edge's right end, then a line.
  const double curvature = weight / (2 * (right - left));
  double area = 0;
  Sum before = 0;
  for (int x = first;; ++x) {
    const bool is_last = x + 1 >= right;
    const double next = is_last ? weight * (x + 1 - middle) : curvature * (x + 1 - left) * (x + 1 - left);
    const Sum covered = quanta(next - area);
    row[x] += covered - before;
    area = next;
    before = covered;
    if (is_last) {
      row[x + 1] += all - covered;
      return;
    }
  }
}

/// The density along the line rises from one end of the longest side to the third corner, and falls to the other end.
void AreaDeposit::add_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, double power) {
  Eigen::Vector2d from = a, to = b, middle = c;
  if ((c - b).squaredNorm() > (to - from).squaredNorm()) from = b, to = c, middle = a;
  if ((a - c).squaredNorm() > (to - from).squaredNorm()) from = c, to = a, middle = b;
  const double length = (to - from).norm();
  const double peak = length > 0 ? std::clamp((middle - from).dot(to - from) / (length * length), 0.0, 1.0) : 0;
  const auto count = static_cast<int>(std::min(1e6, std::ceil(line_points * length))) + 1;
  for (int i = 0; i < count; ++i) {
    const double part = (i + 0.5) / count;
    const double t = part < peak ? std::sqrt(part * peak) : 1 - std::sqrt((1 - part) * (1 - peak));
    add_point(from + t * (to - from), power / count);
  }
}

}  // namespace tensorray
