#pragma once
/// The lattice on which the quads of a flow map lie, and the triangles that they become. Coordinates on it are
/// integers, so that neighbours are found by hashing.

#include <array>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/beam.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

/// A quadrilateral part of the aperture with a lattice of quads; corners counter-clockwise.
struct Patch {
  std::array<Eigen::Vector2d, 4> corners;
  std::array<bool, 4> is_edge{};  ///< Whether the side from each corner to the next is a part of the aperture's edge.
  int columns = 1, rows = 1;

  /// The point at (u, v) in [0, 1]²; bilinear.
  Eigen::Vector2d at(double u, double v) const {
    return (1 - v) * ((1 - u) * corners[0] + u * corners[1]) + v * ((1 - u) * corners[3] + u * corners[2]);
  }
};

/// The size of a pixel in the plane where light starts, as straight light projects it.
double pixel_of_starts(const Plate& plate, const Beam& beam);

/// The size of the first quads, world units. The error of landings between vertices is of second order, so that a finer
/// tolerance has smaller quads. If few vertices are allowed, quads are large: a quarter of the vertices is for the
/// first quads and their first division.
double first_size(const TensorField& field, const Beam& beam, double pixel, const FlowSettings& settings);

/// Patches that cover a convex polygon: one for a parallelogram; else one for each corner, which reaches to the middles
/// of the corner's sides and to that of the polygon. Their first quads are no greater than `quad_size`, but there are
/// at most 4096 along a side.
std::vector<Patch> patches_of(const std::vector<Eigen::Vector2d>& polygon, double quad_size);

/// Patches that cover what a convex polygon has around another one. No side of theirs is an edge.
std::vector<Patch> patches_around(const std::vector<Eigen::Vector2d>& inner, const std::vector<Eigen::Vector2d>& outer,
                                  double quad_size);

struct Quad {
  std::uint32_t patch = 0, x = 0, y = 0;                     // The lower left corner, on the finest lattice.
  int level = 0;                                             // 0: a first quad; each level halves the side.
  float deviation = std::numeric_limits<float>::infinity();  // That of the parent's landings; see `deviation_of`.
  float error = std::numeric_limits<float>::infinity();      // Estimated error of landings within, pixels.
  std::array<std::uint32_t, 4> corners{};                    // Vertices, counter-clockwise from the lower left.
};

/// The patches, and the vertices that are at points of their finest lattices.
struct FlowLattice {
  std::vector<Patch> patches;
  int levels = 1;          ///< Number of divisions from the first quads to the smallest ones, up to 14.
  bool is_graded = false;  ///< Whether vertices are closer to each other at the aperture's edge.
  std::unordered_map<std::uint64_t, std::uint32_t> vertices;  ///< Their indices in the map, by `key`.

  static std::uint64_t key(std::uint32_t patch, std::uint32_t x, std::uint32_t y) {
    return std::uint64_t{patch} << 58 | std::uint64_t{x} << 29 | y;
  }

  std::uint32_t side_of(const Quad& quad) const { return 1u << (levels - quad.level); }

  /// Where a column or a row of the finest lattice lies, from 0 to 1 across the patch. They are evenly spaced. If
  /// `is_graded`, in the first quads at the aperture's edge, the distance from the edge grows as the square of their
  /// number. (Light that leaves the volume at once, through the face along which it goes, lands at a distance that is
  /// as the root of this one.)
  double u_of(std::uint32_t patch, std::uint32_t x) const;
  double v_of(std::uint32_t patch, std::uint32_t y) const;

  /// Whether the quad is a part of a first quad that has a side at the aperture's edge.
  bool is_at_edge(const Quad& quad) const;
};

/// Adds the triangles and edges of `quads` to `map`. The quads cover the lattice once; the map has the landings of
/// their corners. A quad becomes two triangles. If a neighbour is finer, it becomes as many as there are vertices on
/// its outline, about a new vertex in its middle, whose landings are the mean of the corners'.
void add_triangles(const FlowLattice& lattice, const std::vector<Quad>& quads, const Beam& beam, FlowMap& map);

}  // namespace tensorray
