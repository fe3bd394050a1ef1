#pragma once
/// Chooses a field's scale (BendingSettings::scale), and the direction of the light, so that the light shows the field.
///
/// Parallel light at s = 0.2 lands on a plane across it, a quarter of the volume's depth behind the volume. What one
/// sees there is not how far light turns, but how differently neighbouring light turns: by which factor the light about
/// a ray becomes wider or narrower, |det(∂landing/∂start)|. With x, the absolute value of its logarithm, the ray shows
/// x e^(1−x) of the field: 1 for a factor of e, less for a smaller change, and less for a greater one, where light is
/// tangled. Rays that do not land show nothing.

#include <vector>

#include "base/process/progress.h"
#include "renderer/lights/beam.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

constexpr double probe_flexibility = 0.2;  ///< s of the light that chooses.

struct AutoScale {
  double scale = 1;
  double median_turn = 0;    ///< Turn of the median bent ray from start to end, radians, at s = 0.2 and this scale.
  double greatest_turn = 0;  ///< That of the ray that turns most.
  double bent_fraction = 0;  ///< Fraction of the probe rays that the field turns at all.
  double shown = 0;          ///< What the mean ray shows of the field, 0 to 1.
};

/// Finds the least scale that shows 0.85 of what the best scale shows. Scales at which the median ray turns by more
/// than 0.4 rad are left out. Singular points, which tangle at any scale, do not decide, and a field whose structure
/// fills a small part of the volume is judged by that part. If the field only turns light as a whole, the median ray
/// turns by 0.15 to 0.4 rad. A field that turns no ray gets scale 1. Deterministic; runs on all threads.
/// @param geometry  Bounds and cut, without a plate. @throw Cancelled.
AutoScale choose_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, const Progress& progress);

/// The same values at a given scale. @param flexibility  s, instead of 0.2. @throw Cancelled.
AutoScale judge_scale(const TensorField& field, const Geometry& geometry, const Beam& beam, double scale,
                      double flexibility, const Progress& progress);

struct AutoDirection {
  Eigen::Vector3d direction;  ///< Unit.
  AutoScale scale;
  double worth = 0;  ///< What the picture shows: `scale.shown`, less where the silhouette is a strip.
};

/// The 26 directions along the world's axes and the diagonals between them, those that show most first; each at the
/// scale that choose_scale finds with a part of its rays. (Along its axes a part shows little: they are often principal
/// directions of its tensors, along which light goes straight.) @throw as above.
std::vector<AutoDirection> rank_directions(const TensorField& field, const Geometry& geometry,
                                           const Eigen::Vector3d& up, const Progress& progress);

/// The first of them; −z if none shows anything.
AutoDirection choose_direction(const TensorField& field, const Geometry& geometry, const Eigen::Vector3d& up,
                               const Progress& progress);

}  // namespace tensorray
