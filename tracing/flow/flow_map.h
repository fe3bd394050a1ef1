#pragma once
/// The flow map of a beam: where light from each point of the beam's aperture lands on a plate, for a range of
/// flexibilities. It is a mesh of rays, finer where the map bends, folds or tears.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/process/progress.h"
#include "renderer/lights/beam.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

class Job;
struct FlowMap;

struct FlowSettings {
  /// Flexibilities of the light that is followed. If they are the two ends of a `range`, the map holds a continuum
  /// between them; otherwise each is on its own.
  std::vector<double> flexibilities;
  bool range = false;

  /// Landings are in its pixels. It lies in the plane of the geometry's plate, which may be larger. None: it is the
  /// plate of the geometry, and the map goes on beyond its edges by an eighth of its size.
  std::optional<Plate> plate;

  double tolerance = 0.5;  ///< Wanted error of landings between vertices, pixels; > 0.
  double finest = 0.5;     ///< Size of the smallest quads, pixels of straight light; the tolerance if it is less; > 0.
                           ///< Light on a plate has twice as large ones away from edges and tears.

  bool silhouette = true;  ///< Whether the edge of the aperture is that of the volume, and the map is drawn as light.
                           ///< Rays from the edge start a little further inside, as they must enter the volume.
  bool beside = false;     ///< Whether light that lands beside the plate is as important as light on it.

  bool side_light = true;  ///< Whether light that leaves the volume by a side face counts (SideFaces; parallel light).

  std::size_t max_starts = std::size_t{1} << 20;  ///< Refinement stops at so many vertices; > 0.

  Job* job = nullptr;  ///< Whose ranks trace the map together, each a part of its rays; null: alone.

  /// Whether the map is a unit of the job, which keeps where the light of its vertices lands: when it is complete, if
  /// that took long. A map that finds landings there is the same, without tracing them. Of a shard, it is only that of
  /// its part: first quads in blocks, of which each shard has some everywhere.
  bool is_kept = false;

  /// Called after each division of quads, with a function that makes the map so far. Empty: nobody wants it.
  std::function<void(const std::function<FlowMap()>& so_far)> show;
};

/// A triangle of neighbouring vertices.
struct FlowTriangle {
  std::array<std::uint32_t, 3> corners{};  ///< Indices of vertices.
  double area = 0;       ///< Area of the aperture, world units²; of a point's light, the solid angle.
  float error = 0;       ///< Estimated error of landings within, pixels.
  bool is_torn = false;  ///< The map jumps within it, at some wavelength; see `jumps`.
};

/// A side of one triangle, or of two.
struct FlowEdge {
  static constexpr std::uint32_t none = 0xffffffffu;
  std::uint32_t from = 0, to = 0;              ///< Indices of vertices.
  std::uint32_t along = none, against = none;  ///< The triangle that has it in this sense, and in the other one.
};

/// A mesh of triangles whose vertices say where light starts, and where it lands at each wavelength sample. A sample is
/// a flexibility. In a range, samples are evenly spaced in flexibility, ends included, and landings between two of them
/// lie on the straight line between theirs. A place among the samples is a number from 0, the first one, to
/// `wavelengths` − 1, the last one; in a range also between two.
struct FlowMap {
  std::size_t wavelengths = 1;            ///< Number of wavelength samples.
  std::vector<Eigen::Vector2d> starts;    ///< In the beam's frame (right, up), world units.
  std::vector<Eigen::Vector2f> landings;  ///< Pixels of the plate, or beyond its edges; sample k of vertex i is at
                                          ///< [i · wavelengths + k].
  std::vector<RayEnd> ends;               ///< In the same order; landings are valid where this is `plate`.
  std::size_t check_step = 1;             ///< At every so many samples there are lengths.
  std::vector<float> lengths;             ///< Length of the way, world units, at these samples, in the same order.
  std::vector<FlowTriangle> triangles;    ///< They cover the aperture once; neighbours follow each other.
  std::vector<FlowEdge> edges;            ///< All sides of the triangles, once.
  std::size_t rays = 0;                   ///< Number of rays that were traced.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  bool is_complete = true;  ///< Whether every triangle is as fine as `tolerance` asks.

  bool landed(std::size_t vertex, std::size_t sample) const {
    return ends[vertex * wavelengths + sample] == RayEnd::plate;
  }
  Eigen::Vector2f landing(std::size_t vertex, std::size_t sample) const {
    return landings[vertex * wavelengths + sample];
  }
  bool is_range() const { return check_step > 1; }  ///< Whether the samples are those of a range that is not empty.
  std::size_t checks() const { return (wavelengths - 1) / check_step + 1; }  ///< Number of samples with lengths.
};

/// Where light of one vertex lands, at a place among the wavelength samples.
struct FlowLanding {
  RayEnd end = RayEnd::missed;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< Pixels; valid if `end` is `plate`.
};

/// Between two samples of which only one landed, the nearer one counts.
inline FlowLanding landing_at(const FlowMap& map, std::size_t vertex, double sample) {
  const auto before = std::min(static_cast<std::size_t>(sample), map.wavelengths - 1);
  const std::size_t after = std::min(before + 1, map.wavelengths - 1);
  const double part = sample - static_cast<double>(before);
  const std::size_t a = vertex * map.wavelengths + before, b = vertex * map.wavelengths + after;
  const std::size_t nearest = part < 0.5 ? a : b;
  if (map.ends[a] != RayEnd::plate || map.ends[b] != RayEnd::plate)
    return {map.ends[nearest], map.landings[nearest].cast<double>()};
  return {RayEnd::plate, (1 - part) * map.landings[a].cast<double>() + part * map.landings[b].cast<double>()};
}

/// The side of a smallest quad may be torn if the landings at its ends are farther apart than this; pixels.
constexpr double torn_pixels = 1;

/// Whether the landings of a triangle's corners, at one wavelength, lie on two sides of a tear.
inline bool jumps(bool is_torn, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return is_torn &&
         std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}) > torn_pixels * torn_pixels;
}

/// Traces the map from `beam` to the plane of the plate. `right` and `up` of the beam need not be across its direction:
/// its light may start on any plane.
///
/// The mesh begins as a lattice of quads; an aperture that is no parallelogram has a lattice for each corner. A quad is
/// divided into four while its error is likely to be too great, or if light of some of its corners lands and that of
/// others does not, and where it ends is not known (cutoff.h), down to the finest size. A range has 33 wavelength
/// samples, of which most are predicted where landings are smooth (wavelength_tracer.h). docs/dev/flow_maps.md has the
/// rules, with equations.
///
/// If `geometry` has a body instead of a plate, the landings of light from the volume are the projections of the points
/// of the body on `settings.plate`: along its normal, or from the beam's source if it has one. Light counts as landed
/// only if nothing of the body is between its point and the light, on the side of the plate's normal: other points have
/// the same projection.
///
/// The result is the same for any number of threads and processes; but the numbers of rays, steps and tensor samples
/// are those of this process. @throw std::invalid_argument if a setting is out of range or there is no plate;
/// Cancelled; as Ranks::all_gather.
FlowMap trace_flow_map(const TensorField& field, const Geometry& geometry, const Beam& beam,
                       const BendingSettings& bending, const FlowSettings& settings, const Progress& progress);

}  // namespace tensorray
