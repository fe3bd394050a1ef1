#pragma once
/// @file renderer/film/area_deposit.h
/// Exact deposit of light on pixels: each pixel gets the area that it shares with each triangle.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Adds polygons of even density to a plane of pixels, edge by edge.
///
/// An edge that goes down adds its density to the area between it and the right border of the plate, and one that goes
/// up takes it away. So the edges of a polygon, in order, leave the density within it. The edge between two polygons is
/// added once, with the difference of their densities. Each pixel gets the part of this area that it contains; a last
/// pass sums each row from the left. (Font rasterisers draw outlines this way.) The cost grows with the length of the
/// edges, not with the area.
///
/// Sums are integers, in units of 2^-46 of the power 1, and wrap around. The result therefore does not depend on the
/// order of the edges.
class AreaDeposit {
 public:
  /// @throw std::invalid_argument if a size is < 1.
  AreaDeposit(int width, int height);

  void clear();

  /// The density of a triangle with `power` (>= 0; at most 1 in all) for its edges, in the order a, b, c; of either
  /// orientation. If the triangle lies within one pixel, or has no area, its power is added here (without area: along a
  /// line), and the density is 0.
  /// @param a,b,c  Pixel coordinates: pixel (x, y) covers [x, x+1) × [y, y+1); finite.
  double triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, double power);

  /// Adds an edge between polygons. What lies beyond the plate is cut off.
  /// @param density  That of the polygon of which it is a side, less that of the polygon that has it as a side in the
  ///                 other sense.
  void add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double density);

  /// Adds a triangle that has no neighbours.
  void add_triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, double power);

  /// Adds `power` to the pixel that contains `at`, if there is one. A point on the right or lower edge counts as
  /// inside.
  void add_point(const Eigen::Vector2d& at, double power);

  /// Writes the power of each pixel of a row to `power` (`width` values).
  void read_row(int y, double* power) const;

 private:
  using Sum = std::uint64_t;

  void add_span(Sum* row, double left, double right, double weight) const;
  void add_inner_span(Sum* row, double left, double right, double weight) const;
  void add_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, double power);

  Sum* row(int y) { return sums_.data() + static_cast<std::size_t>(y) * stride_; }

  int width_, height_;
  std::size_t stride_;     // Two more than the width: an edge on the right border adds there.
  std::vector<Sum> sums_;  // The power of a pixel is the sum from the beginning of its row up to it.
};

}  // namespace tensorray
