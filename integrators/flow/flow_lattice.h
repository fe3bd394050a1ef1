#pragma once
/// @file integrators/flow/flow_lattice.h
/// The lattice on which the squares of a flow map lie. A part of flow_map.cpp.

#include <array>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// A quadrilateral part of the aperture with a lattice of squares; corners counter-clockwise.
struct Patch {
  std::array<Eigen::Vector2d, 4> corners;
  std::array<bool, 4> is_edge{};  ///< Whether the side from each corner to the next is a part of the aperture's edge.
  int columns = 1, rows = 1;

  /// The point at (u, v) in [0, 1]²; bilinear.
  Eigen::Vector2d at(double u, double v) const {
    return (1 - v) * ((1 - u) * corners[0] + u * corners[1]) + v * ((1 - u) * corners[3] + u * corners[2]);
  }
};

/// Patches that cover a convex polygon: one, or one about each corner, which reaches to the middles of the sides and of
/// the polygon. Each has as many first squares as it takes for none to be greater than `square_size`, up to 4096 along
/// a side.
std::vector<Patch> patches_of(const std::vector<Eigen::Vector2d>& polygon, double square_size);

struct Square {
  std::uint32_t patch = 0, x = 0, y = 0;                     // The lower left corner, on the finest lattice.
  int level = 0;                                             // 0: a first square; each level halves the side.
  float deviation = std::numeric_limits<float>::infinity();  // That of the parent's landings; see `deviation_of`.
  float error = std::numeric_limits<float>::infinity();      // Estimated error of landings within, pixels.
  std::array<std::uint32_t, 4> corners{};                    // Positions, counter-clockwise from the lower left.
};

/// The patches, and the positions that are at points of their finest lattices.
struct FlowLattice {
  std::vector<Patch> patches;
  int levels = 1;          ///< Number of divisions from the first squares to the smallest ones, up to 14.
  int still_levels = 0;    ///< Of these divisions, the last ones that only light needs which all lands in one place.
  bool is_graded = false;  ///< Whether positions are closer to each other at the aperture's edge.
  std::unordered_map<std::uint64_t, std::uint32_t> positions;  ///< Their indices in the map, by `key`.

  static std::uint64_t key(std::uint32_t patch, std::uint32_t x, std::uint32_t y) {
    return std::uint64_t{patch} << 58 | std::uint64_t{x} << 29 | y;
  }

  std::uint32_t side_of(const Square& square) const { return 1u << (levels - square.level); }

  /// Where a column or a row of the finest lattice lies, as a part of the patch's width or height. They are evenly
  /// spaced, but in the first squares at the aperture's edge the distance from it grows as the square of their number,
  /// if `is_graded`: light that leaves the volume at once, through the face along which it goes, lands where the root
  /// of this distance says.
  double u_of(std::uint32_t patch, std::uint32_t x) const;
  double v_of(std::uint32_t patch, std::uint32_t y) const;

  /// Whether the square is a part of a first square that has a side at the aperture's edge.
  bool is_at_edge(const Square& square) const;

  /// Whether a side of the square is one of its patch.
  bool is_on_border(const Square& square) const;
};

}  // namespace tensorray
