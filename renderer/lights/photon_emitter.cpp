#include "renderer/lights/photon_emitter.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A point of a convex polygon, uniform over its area.
Vector2d sample_polygon(const std::vector<Vector2d>& polygon, Vector2d u) {
  const auto triangle = [&](std::size_t i) { return std::vector{polygon[0], polygon[i], polygon[i + 1]}; };
  double rest = u.x() * area(polygon);
  for (std::size_t i = 1;; ++i) {
    const double part = area(triangle(i));
    if (rest >= part && i + 2 < polygon.size()) {
      rest -= part;
      continue;
    }
    u.x() = std::min(rest / part, 1.0);
    const Vector3d weights = square_to_triangle(u);
    return weights[0] * polygon[0] + weights[1] * polygon[i] + weights[2] * polygon[i + 1];
  }
}

}  // namespace

PhotonEmitter::PhotonEmitter(const Light& light, std::vector<Vector3d> corners, const Eigen::AlignedBox3d& scene)
    : corners_(std::move(corners)), scene_(scene) {
  if (const auto* point = std::get_if<PointLight>(&light)) {
    beam_ = point_beam(corners_, point->position);
  } else if (const auto* sun = std::get_if<DirectionalLight>(&light)) {
    beam_ = beam_towards(sun->direction.normalized());
    angle_ = sun->angle;
  } else {
    throw std::invalid_argument("only directional lights and points emit photons");
  }
}

/// Starts before the whole scene.
Beam PhotonEmitter::beam_towards(const Vector3d& direction) const {
  Beam beam = silhouette_beam(corners_, direction, Vector3d::UnitZ());
  if (scene_.isEmpty()) return beam;
  double before = 0;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner = scene_.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    before = std::min(before, (corner - beam.center).dot(direction));
  }
  beam.center += (before - 1e-3 * scene_.diagonal().norm()) * direction;
  return beam;
}

/// Of a disk of even radiance each direction has its own beam, so that no light is lost at the volume's silhouette.
EmittedPhoton PhotonEmitter::sample(PathSampler& sampler) const {
  const Vector2d place = sampler.next_2d();
  if (angle_ > 0) {
    const Vector3d direction = frame_about(beam_.direction) * square_to_cone(sampler.next_2d(), angle_);
    const Beam beam = beam_towards(direction);
    const double radiance = 1 / (pi * std::pow(std::sin(angle_), 2));
    return {beam.start(sample_polygon(beam.aperture, place)), beam.direction,
            radiance * cone_solid_angle(angle_) * area(beam.aperture)};
  }
  const Vector3d start = beam_.start(sample_polygon(beam_.aperture, place)), direction = beam_.direction_at(start);
  const double spread = beam_.source ? direction.dot(beam_.direction) / (start - *beam_.source).squaredNorm() : 1;
  return {start, direction, spread * area(beam_.aperture)};
}

double PhotonEmitter::power() const {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < beam_.aperture.size(); ++i)
    sum += start_area(beam_, beam_.aperture[0], beam_.aperture[i], beam_.aperture[i + 1]);
  return sum;
}

}  // namespace tensorray
