#include "renderer/lights/photon_emitter.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/constants.h"
#include "base/overloaded.h"

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
  const auto from_point = [&](const PointLight& point) {
    if (is_surrounded(point.position, corners_))
      surrounded_ = point.position;
    else
      beam_ = point_beam(corners_, point.position);
  };
  const auto from_sun = [&](const DirectionalLight& sun) {
    beam_ = beam_towards(sun.direction.normalized());
    angle_ = sun.angle;
  };
  const auto none = [] { throw std::invalid_argument("only directional lights, points and area lights emit photons"); };
  std::visit(Overloaded{from_point, from_sun, [&](const AreaLight& area) { lamp_ = make_lamp(area, corners_); },
                        [&](const ConstantLight&) { none(); }, [&](const EnvironmentLight&) { none(); }},
             light);
}

PhotonEmitter::Lamp PhotonEmitter::make_lamp(const AreaLight& light, const std::vector<Vector3d>& corners) {
  Eigen::AlignedBox3d volume;
  for (const Vector3d& corner : corners) volume.extend(corner);
  std::vector<double> areas;
  for (std::size_t i = 0; i < light.mesh.triangles.size(); ++i)
    areas.push_back(triangle_normal(light.mesh, i).norm() / 2);
  return {light.mesh, Distribution1D(areas), volume.center(), volume.diagonal().norm() / 2};
}

double PhotonEmitter::Lamp::angle(const Vector3d& position) const {
  return std::asin(radius / (center - position).norm());
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

EmittedPhoton PhotonEmitter::sample(PathSampler& sampler) const {
  if (lamp_) return sample_lamp(sampler);
  if (surrounded_) return {*surrounded_, square_to_sphere(sampler.next_2d()), 4 * pi};
  return angle_ > 0 ? sample_sun(sampler) : sample_beam(sampler);
}

/// Of a disk of even radiance each direction has its own beam, so that no light is lost at the volume's silhouette.
EmittedPhoton PhotonEmitter::sample_sun(PathSampler& sampler) const {
  const Vector2d place = sampler.next_2d();
  const Vector3d direction = frame_about(beam_.direction) * square_to_cone(sampler.next_2d(), angle_);
  const Beam beam = beam_towards(direction);
  const double radiance = 1 / (pi * std::pow(std::sin(angle_), 2));
  return {beam.start(sample_polygon(beam.aperture, place)), beam.direction,
          radiance * cone_solid_angle(angle_) * area(beam.aperture)};
}

EmittedPhoton PhotonEmitter::sample_beam(PathSampler& sampler) const {
  const Vector3d start = beam_.start(sample_polygon(beam_.aperture, sampler.next_2d()));
  const Vector3d direction = beam_.direction_at(start);
  const double spread = beam_.source ? direction.dot(beam_.direction) / (start - *beam_.source).squaredNorm() : 1;
  return {start, direction, spread * area(beam_.aperture)};
}

/// Even over the area, and over the cone about the ball; within the ball, as a diffuse surface. Starts off the light.
EmittedPhoton PhotonEmitter::sample_lamp(PathSampler& sampler) const {
  const auto triangle = static_cast<std::size_t>(lamp_->triangles.sample(sampler.next_1d()).cell);
  const Vector3d weights = square_to_triangle(sampler.next_2d());
  const auto& corner = lamp_->mesh.triangles[triangle];
  const Vector3d normal = triangle_normal(lamp_->mesh, triangle).normalized();
  Vector3d position = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) position += weights[i] * lamp_->mesh.vertices[corner[static_cast<std::size_t>(i)]];
  const Vector2d turn = sampler.next_2d();
  const Vector3d direction = lamp_->is_within(position)
                                 ? Vector3d(frame_about(normal) * square_to_cosine_hemisphere(turn))
                                 : Vector3d(frame_about((lamp_->center - position).normalized()) *
                                            square_to_cone(turn, lamp_->angle(position)));
  EmittedPhoton photon{position + 1e-5 * lamp_->radius * normal, direction};
  photon.density = density(position, normal, direction);
  if (photon.density > 0) photon.power = 1 / photon.density;
  return photon;
}

double PhotonEmitter::density(const Vector3d& position, const Vector3d& normal, const Vector3d& direction) const {
  const double cosine = normal.dot(direction), area = lamp_->triangles.sum();
  if (!(cosine > 0)) return 0;
  return 1 / (area * (lamp_->is_within(position) ? pi : cone_solid_angle(lamp_->angle(position)) * cosine));
}

double PhotonEmitter::power() const {
  if (lamp_) {
    double sum = 0;
    for (std::size_t i = 0; i < lamp_->mesh.triangles.size(); ++i) {
      const Vector3d across = triangle_normal(lamp_->mesh, i) / 2;
      const Vector3d position = lamp_->mesh.vertices[static_cast<std::size_t>(lamp_->mesh.triangles[i][0])];
      const Vector3d way = lamp_->center - position;
      sum += lamp_->is_within(position)
                 ? across.norm() * pi
                 : std::max(0.0, across.dot(way.normalized())) * cone_solid_angle(lamp_->angle(position));
    }
    return sum;
  }
  if (surrounded_) return 4 * pi;
  double sum = 0;
  for (std::size_t i = 1; i + 1 < beam_.aperture.size(); ++i)
    sum += start_area(beam_, beam_.aperture[0], beam_.aperture[i], beam_.aperture[i + 1]);
  return sum;
}

}  // namespace tensorray
