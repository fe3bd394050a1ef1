#pragma once
/// A beam of light that passes through an aperture.

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "renderer/surfaces/plate.h"

namespace tensorray {

enum class BeamPattern { grid, stratified, sobol, random };

/// Parallel light, or a point's. It starts at the plane through `center`; positions there are along (right, up).
struct Beam {
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< Unit; of a point's light, the axis of the beam.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();       ///< World.
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();       ///< Unit, across the beam.
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();          ///< Unit, across the beam.
  std::vector<Eigen::Vector2d> aperture;                  ///< Convex polygon, counter-clockwise in (right, up).
  std::vector<Eigen::Vector2d> core;      ///< The part of the aperture whose light meets the volume; empty: all of it.
  std::optional<Eigen::Vector3d> source;  ///< The point that the light comes from; none: parallel.

  /// World, of a position across the beam.
  Eigen::Vector3d start(const Eigen::Vector2d& across) const { return center + across.x() * right + across.y() * up; }

  /// Unit; of the light that starts at a point of the plane.
  Eigen::Vector3d direction_at(const Eigen::Vector3d& start) const {
    return source ? Eigen::Vector3d((start - *source).normalized()) : direction;
  }
};

/// The beam whose aperture is the silhouette of `points` (their convex hull seen along `direction`). It starts in front
/// of all points. `up` sets the frame (see `upright`).
/// @throw std::invalid_argument if the silhouette has no area.
Beam silhouette_beam(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& direction,
                     const Eigen::Vector3d& up);

/// The part of the aperture whose light meets the volume.
inline const std::vector<Eigen::Vector2d>& core_of(const Beam& beam) {
  return beam.core.empty() ? beam.aperture : beam.core;
}

/// The beam with an aperture so wide that its light, if nothing bends it, also goes through `points`. What was the
/// aperture is its core. Parallel light only.
Beam widened_beam(Beam beam, const std::vector<Eigen::Vector3d>& points);

/// Whether a source is among `points`, or so near that they are all around it: no beam from it covers them.
bool is_surrounded(const Eigen::Vector3d& source, const std::vector<Eigen::Vector3d>& points);

/// The beam from `source` whose aperture is the silhouette of `points`. It starts near the source.
/// @throw std::invalid_argument if the points surround the source.
Beam point_beam(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& source);

/// How much smaller lengths are where light starts than at a point, as straight light projects them; parallel: 1.
double start_ratio(const Beam& beam, const Eigen::Vector3d& point);

/// The area of a triangle of positions across the beam, or, seen from its source, the solid angle.
double start_area(const Beam& beam, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

double area(const std::vector<Eigen::Vector2d>& polygon);

/// The bounding rectangle of the aperture, as it is seen along the light. @param depth  From the plane where the light
/// starts. @param pixels  Along the longer side.
Plate plate_across(const Beam& beam, double depth, int pixels);

/// One position where light starts.
struct Emission {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< World.
  Eigen::Vector2d across = Eigen::Vector2d::Zero();  ///< In the bounding rectangle of the aperture, from 0 to 1.
  double stratum = 0;  ///< In [0, 1), stratified jointly with the position; chooses among wavelengths.
};

/// The positions where the light of a beam starts, as a function of an index. Immutable; threads may share it.
class BeamSampler {
 public:
  /// @param count  Approximate number of positions in the aperture.
  /// @throw std::invalid_argument if count is 0, or above the pattern's limit.
  BeamSampler(const Beam& beam, BeamPattern pattern, std::uint64_t count, std::uint64_t seed);

  std::uint64_t candidates() const { return candidates_; }  ///< Indices are below this.
  double area_per_candidate() const { return area_per_candidate_; }

  /// Sets `emission` and returns true if candidate `index` lies in the aperture.
  bool sample(std::uint64_t index, Emission& emission) const;

 private:
  Eigen::Vector3d unit_sample(std::uint64_t index) const;
  Eigen::Vector3d cell_sample(std::uint64_t index, const Eigen::Vector2d& within) const;

  Beam beam_;
  BeamPattern pattern_;
  std::uint64_t seed_;
  Eigen::Vector2d corner_, extent_;  // Bounding rectangle of the aperture.
  std::uint64_t columns_ = 1, rows_ = 1, candidates_ = 0;
  double area_per_candidate_ = 0;
};

}  // namespace tensorray
