#pragma once
/// Exact deposit of light on pixels: each pixel gets the area that it shares with each triangle.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Sums of four planes, pixel by pixel: those of pixel x of row y, counted from the first row that is kept, are at
/// [4 (y · stride + x)].
struct DepositPlanes {
  static constexpr std::size_t count = 4;
  std::uint64_t* sums = nullptr;
  std::size_t stride = 0;          ///< Pixels from row to row; at least three more than the width.
  int width = 0;                   ///< Of the plate, pixels.
  int first_row = 0, end_row = 0;  ///< Other rows are not kept.
};

/// Added to a number of at most 2^51, 1.5 · 2^52 leaves the nearest integer in the last bits of the sum.
constexpr double integer_bits = 6755399441055744.0;

/// Edges between polygons, all of them between the left and the right border of the plate.
struct EdgeBatch {
  static constexpr std::size_t capacity = 256;

  std::size_t count = 0;
  alignas(64) double from_x[capacity], from_y[capacity], to_x[capacity], to_y[capacity];  // Pixels.
  alignas(64) double density[capacity];
};

/// Adds the edges, with the part `plane_weights` of them to each plane. Sums are the same, bit for bit, in any batch.
void deposit_edges(const EdgeBatch& batch, const double* plane_weights, const DepositPlanes& planes);

/// Adds polygons of even density to four planes of pixels, edge by edge.
///
/// An edge that goes down adds its density to the area between it and the right border of the plate, and one that goes
/// up takes it away. So the edges of a polygon, in order, leave the density within it. The edge between two polygons is
/// added once, with the difference of their densities. Each pixel gets the part of this area that it contains; a last
/// pass sums each row from the left. (Font rasterisers draw outlines this way.) The cost grows with the edges' length.
///
/// Sums are integers, in units of 2^-48 of the power 1, and wrap around. The result therefore does not depend on the
/// order of the edges, nor on how they are divided among several deposits that are added afterwards.
class AreaDeposit {
 public:
  using PlaneWeights = std::array<double, DepositPlanes::count>;

  /// @param width,height       Size of the plate, pixels.
  /// @param first_row,end_row  The rows that are kept; light on others is dropped. Without them, all rows.
  /// @throw std::invalid_argument if there is no pixel.
  AreaDeposit(int width, int height, int first_row, int end_row);
  AreaDeposit(int width, int height) : AreaDeposit(width, height, 0, height) {}

  /// The part of the power that each plane gets of what is added from now on; from -1 to 1. At first, 1 and 0, 0, 0.
  void set_plane_weights(const PlaneWeights& plane_weights);

  /// The density of a triangle with `power` (>= 0; at most 1 in all) for its edges, in the order a, b, c; of either
  /// orientation. If the triangle lies within one pixel, or has no area, its power is added here (without area: along a
  /// line), and the density is 0. It is also 0 beside the plate.
  /// @param a,b,c  Pixel coordinates: pixel (x, y) covers [x, x+1) × [y, y+1); finite.
  double triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, double power);

  /// Adds an edge between polygons, at once or with the next ones. What lies beyond the plate is cut off.
  /// @param density  That of the polygon of which it is a side, less that of the polygon that has it as a side in the
  ///                 other sense.
  void add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double density);

  /// Adds `power` to the pixel that contains `at`, if any. A point on the right or lower edge is inside.
  void add_point(const Eigen::Vector2d& at, double power);

  /// Adds the edges that wait.
  void flush();

  /// The sums of the kept rows, which have no meaning of their own. Call flush() before.
  std::vector<std::uint64_t>& sums() { return sums_; }

  /// Adds the sums of a deposit of the same rows. @throw std::invalid_argument if it is of other rows.
  void add(const std::vector<std::uint64_t>& sums);

  /// The power of each pixel of a row, in one plane: adds it up from deposits of the same rows that have been flushed.
  /// @param power  `width` values.
  static void read_row(const std::vector<const AreaDeposit*>& deposits, int y, int plane, double* power);

 private:
  void add_difference(int x, int y, double covered, double before);

  std::size_t place(int x, int y) const {
    return DepositPlanes::count * (static_cast<std::size_t>(y - first_row_) * stride_ + static_cast<std::size_t>(x));
  }

  int width_, height_, first_row_, end_row_;
  std::size_t stride_;  // Three more than the width: an edge on the right border adds there.
  PlaneWeights plane_weights_{1};
  EdgeBatch batch_;
  std::vector<std::uint64_t> sums_;  // The power of a pixel is the sum from the beginning of its row up to it.
};

/// Whether AreaDeposit gives the power of a point to a pixel of a plate: also on the plate's right and lower edges.
bool is_on_plate(const Eigen::Vector2d& at, const Eigen::Vector2i& plate);

/// The part of a triangle's power that AreaDeposit gives to the pixels of a plate.
double part_on_plate(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                     const Eigen::Vector2i& plate);

}  // namespace tensorray
