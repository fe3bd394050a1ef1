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
  } else if (const auto* area = std::get_if<AreaLight>(&light)) {
    lamp_ = make_lamp(*area, corners_);
  } else {
    throw std::invalid_argument("only directional lights, points and area lights emit photons");
  }
}

PhotonEmitter::Lamp PhotonEmitter::make_lamp(const AreaLight& light, const std::vector<Vector3d>& corners) {
  Eigen::AlignedBox3d volume, box;
  for (const Vector3d& corner : corners) volume.extend(corner);
  for (const Vector3d& vertex : light.mesh.vertices) box.extend(vertex);
  if (volume.intersects(box)) throw std::invalid_argument("an area light with photons must be outside the volume");
  std::vector<double> areas;
  for (std::size_t i = 0; i < light.mesh.triangles.size(); ++i)
    areas.push_back(triangle_normal(light.mesh, i).norm() / 2);
  return {light.mesh, Distribution1D(areas), volume.center(), volume.diagonal().norm() / 2};
}

double PhotonEmitter::Lamp::angle(const Vector3d& position) const {
  const double distance = (center - position).norm();
  return distance > radius ? std::asin(radius / distance) : pi;
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
  if (lamp_) return sample_lamp(sampler);
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

/// Even over the area, and over the cone about the ball. Starts a little off the light, which would stop it.
EmittedPhoton PhotonEmitter::sample_lamp(PathSampler& sampler) const {
  const auto triangle = static_cast<std::size_t>(lamp_->triangles.sample(sampler.next_1d()).cell);
  const Vector3d weights = square_to_triangle(sampler.next_2d());
  const auto& corner = lamp_->mesh.triangles[triangle];
  const Vector3d normal = triangle_normal(lamp_->mesh, triangle).normalized();
  Vector3d position = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) position += weights[i] * lamp_->mesh.vertices[corner[static_cast<std::size_t>(i)]];
  const double angle = lamp_->angle(position);
  const Vector3d direction =
      frame_about((lamp_->center - position).normalized()) * square_to_cone(sampler.next_2d(), angle);
  EmittedPhoton photon{position + 1e-6 * lamp_->radius * normal, direction};
  photon.density = density(position, normal, direction);
  if (photon.density > 0) photon.power = 1 / photon.density;
  return photon;
}

double PhotonEmitter::density(const Vector3d& position, const Vector3d& normal, const Vector3d& direction) const {
  const double angle = lamp_->angle(position), cosine = normal.dot(direction);
  const double area = lamp_->triangles.sum();
  return cosine > 0 ? 1 / (area * cone_solid_angle(angle) * cosine) : 0;
}

double PhotonEmitter::power() const {
  if (lamp_) {
    double sum = 0;
    for (std::size_t i = 0; i < lamp_->mesh.triangles.size(); ++i) {
      const Vector3d across = triangle_normal(lamp_->mesh, i) / 2;
      const Vector3d position = lamp_->mesh.vertices[static_cast<std::size_t>(lamp_->mesh.triangles[i][0])];
      const Vector3d way = lamp_->center - position;
      sum += std::max(0.0, across.dot(way.normalized())) * cone_solid_angle(lamp_->angle(position));
    }
    return sum;
  }
  double sum = 0;
  for (std::size_t i = 1; i + 1 < beam_.aperture.size(); ++i)
    sum += start_area(beam_, beam_.aperture[0], beam_.aperture[i], beam_.aperture[i + 1]);
  return sum;
}

}  // namespace tensorray
