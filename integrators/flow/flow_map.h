#pragma once
/// @file integrators/flow/flow_map.h
/// The flow map of a beam: where light from each point of the beam's aperture lands on a plate, for a range of
/// flexibilities. It is a mesh of rays, finer where the map bends, folds or tears.

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "base/progress.h"
#include "integrators/bending/bending.h"
#include "integrators/bending/light_channel.h"
#include "renderer/lights/beam.h"

namespace tensorray {

class RayMemory;
class Team;

struct FlowSettings {
  /// Flexibilities of the light that is followed. If they are the two ends of a `range`, the map holds a continuum
  /// between them; otherwise each is on its own.
  std::vector<double> flexibilities;
  bool range = false;

  double tolerance = 0.5;  ///< Wanted error of landings between positions, pixels; > 0.
  double finest = 0.5;     ///< Size of the smallest squares (half of it for light that stays in one place), pixels of
                           ///< straight light, unless the tolerance is less; > 0.

  bool silhouette = true;  ///< Whether the edge of the aperture is that of the volume, and the map is drawn as light.
                           ///< Rays from the edge start a little further inside, as they must enter the volume.
  bool beside = false;     ///< Whether light that lands beside the plate is as important as light on it.

  std::size_t most_starts = std::size_t{1} << 20;  ///< Refinement stops at so many positions; > 0.

  Team* team = nullptr;  ///< Processes that trace the same map with this one, each a part of its rays; null: alone.

  /// Rays of maps that differ only in plate and range of flexibilities; null: none is remembered. The map is the same.
  std::shared_ptr<RayMemory> memory;
};

/// A triangle of neighbouring positions.
struct FlowTriangle {
  std::array<std::uint32_t, 3> corners{};  ///< Indices of positions.
  double area = 0;       ///< Area of the aperture, world units²; of a point's light, the solid angle.
  float error = 0;       ///< Estimated error of landings within, pixels.
  bool is_torn = false;  ///< The map jumps within it, at some node; see `jumps`.
};

/// A side of one triangle, or of two.
struct FlowEdge {
  static constexpr std::uint32_t none = 0xffffffffu;
  std::uint32_t from = 0, to = 0;              ///< Indices of positions.
  std::uint32_t along = none, against = none;  ///< The triangle that has it in this sense, and in the other one.
  bool is_diagonal = false;                    ///< Whether its triangles are the halves of a square.
};

/// Positions have landings at `nodes` flexibilities. In a range the nodes are evenly spaced, ends included, and
/// landings between two nodes lie on the straight line between them.
struct FlowMap {
  std::size_t nodes = 1;
  std::vector<Eigen::Vector2d> starts;    ///< In the beam's frame (right, up), world units.
  std::vector<Eigen::Vector2f> landings;  ///< Pixel coordinates; node k of position i is at [i · nodes + k]. They may
                                          ///< lie beyond the plate's edges.
  std::vector<RayEnd> ends;               ///< In the same order; landings are valid where this is `plate`.
  std::size_t check_step = 1;             ///< At every so many nodes there are lengths.
  std::vector<float> lengths;             ///< Length of the way, world units, at these nodes, in the same order.
  std::vector<FlowTriangle> triangles;    ///< They cover the aperture once; neighbours follow each other.
  std::vector<FlowEdge> edges;            ///< All sides of the triangles, once.
  std::size_t rays = 0;                   ///< Number of rays that were traced.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  bool is_complete = true;  ///< Whether every triangle is as fine as `tolerance` asks.
};

/// How finely a spectrum is divided into bands.
struct BandStep {
  double pixels = 1;  ///< Light moves by no more than this from band to band, for 99 of 100 positions.
  int least = 1;      ///< Number of bands, at least; ...
  int most = 128;     ///< ... and at most.
};

/// The number of bands: a multiple of `channels`, whatever the limits are; one a channel if all light bends alike.
int band_count(const FlowMap& map, int channels, const BandStep& step = {});

/// Light of one position at a place among the nodes, in a range also between two of them.
struct FlowLanding {
  RayEnd end = RayEnd::missed;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< Pixels; valid if `end` is `plate`.
};

/// Between two nodes of which only one landed, the nearer one counts.
inline FlowLanding landing_at(const FlowMap& map, std::size_t position, double node) {
  const auto before = std::min(static_cast<std::size_t>(node), map.nodes - 1);
  const std::size_t after = std::min(before + 1, map.nodes - 1);
  const double part = node - static_cast<double>(before);
  const std::size_t a = position * map.nodes + before, b = position * map.nodes + after;
  const std::size_t nearest = part < 0.5 ? a : b;
  if (map.ends[a] != RayEnd::plate || map.ends[b] != RayEnd::plate)
    return {map.ends[nearest], map.landings[nearest].cast<double>()};
  return {RayEnd::plate, (1 - part) * map.landings[a].cast<double>() + part * map.landings[b].cast<double>()};
}

/// Landings at the ends of a smallest square's side that are farther apart may be a tear; pixels.
constexpr double torn_pixels = 1;

/// Whether the landings of a triangle's corners, at one place among the nodes, lie on two sides of a tear.
inline bool jumps(bool is_torn, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return is_torn &&
         std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}) > torn_pixels * torn_pixels;
}

/// Traces the map from `beam` to the plane of `plate`. The plate of `geometry` lies in the same plane and may be
/// larger: the map goes on there. `right` and `up` of the beam need not be across its direction: its light may start on
/// any plane.
///
/// Positions form a lattice of squares of 8 pixels, or of a voxel if that is less, but not more than 64 along a side
/// for that (for an aperture that is no parallelogram, one lattice for each corner). Each is divided into four, and
/// then again, down to the finest size, if the landings within its parent were so far from where the
/// parent's corners predict that an error greater than `tolerance` is likely, or if some of its corners' light lands
/// and some does not. In a map that is drawn as light, the tolerance is times w / n, from 0.5 to the √n of other
/// maps, for a square of n pixels whose light is w pixels wide; and times the cube root of the distance by which the
/// range spreads it, in w. Light that the range does not spread has squares of half the finest size, where all of it
/// lands. In other maps the tolerance is times √n where a square's landings cover n pixels. Squares whose light falls
/// beside the plate stay as they are.
///
/// At the silhouette light leaves at once, through the face along which it goes, or is torn from light that stays: a
/// map with √d, of the distance d from the edge, and with jumps. In the first squares there, positions have distances
/// as the squares of whole numbers, and squares are divided twice before any error is estimated.
///
/// In a range, each position first sends light at 5 of the 33 nodes, or at 3 where the positions beside it agree in
/// what lies between. Where these are smooth, so that an error of more than 1/300 of the tolerance is unlikely,
/// the others are predicted (node_prediction.h); where not, more nodes are traced, up to all, in each quarter of the
/// range on its own. (At a caustic a small error of the landing is a great one of the colour.)
///
/// If `geometry` has a body instead of a plate, the landings of light from the volume are the projections of
/// the points of the body on `plate`: along its normal, or from the beam's source if it has one. Light counts as landed
/// only where nothing of the body is between its point and the light, on the side of the plate's normal: other points
/// have the same projection.
///
/// The result is the same for any number of threads and processes; but for the counts of rays, steps and samples, which
/// are those of this process. @throw std::invalid_argument if a setting is out of range or `geometry` has no plate;
/// Cancelled; as Team::exchange.
FlowMap trace_flow_map(const TensorField& field, const Geometry& geometry, const Plate& plate, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings, const Progress& progress);

/// The map to the plate of `geometry`, which goes on beyond its edges by an eighth of its size. @throw as above, and
/// std::invalid_argument if there is no plate.
FlowMap trace_flow_map(const TensorField& field, const Geometry& geometry, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings, const Progress& progress);

}  // namespace tensorray
