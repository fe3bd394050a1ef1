#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/overloaded.h"
#include "integrators/scene/field_light.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double steepest_along = 0.5;   // Sine of the angle between a plate and light along it; fields turn light.
constexpr double small_lamp = 0.4;       // Radians, seen from the volume: fields turn light by more.
constexpr double photons_in_reach = 10;  // Of a band, within the automatic radius, where light is undisturbed.

LightCaustic caustic_of(const Scene& scene, std::size_t light) {
  const std::vector<LightSourceDescription>& lights = scene.description.lights;
  return light < lights.size() ? lights[light].caustic : LightCaustic::automatic;
}

/// Whether bent light may meet both sides of a plate, or a side that does not face the middle of the volume.
/// @param light  Not the kind that does not land.
bool has_light_on_both_sides(const Plate& plate, const TensorField& field, const Light& light) {
  const Eigen::AlignedBox3d volume = field.world_box();
  const Vector3d normal = plate.normal();
  const double height = normal.dot(volume.center() - plate.center);
  Eigen::AlignedBox3d box;
  for (const Vector3d& vertex : rectangle_mesh(plate.center, plate.right, plate.up, plate.size).vertices)
    box.extend(vertex);
  const bool is_early = height * normal.dot(*direction_at(light, volume.center())) > 0;
  if (box.intersects(volume) && is_early) return true;
  const Vector3d direction = direction_at(light, plate.center)->normalized();
  const double reach = normal.cwiseAbs().dot(volume.sizes()) / 2;  // Of the volume, on each side of its middle.
  return std::abs(height) < reach && std::abs(normal.dot(direction)) < steepest_along;
}

/// Whether a lamp is so small, as seen from afar in the volume, that straight aim misses it.
bool is_small(const TriangleMesh& lamp, const TensorField& field) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& vertex : lamp.vertices) box.extend(vertex);
  const double distance = (box.center() - field.world_box().center()).norm();
  return box.diagonal().norm() < small_lamp * std::max(distance, field.world_box().diagonal().norm() / 2);
}

/// Whether a point light is in the volume, or so near that it is all around.
bool is_within(const Light& light, const TensorField& field) {
  return std::visit(
      Overloaded{[&](const PointLight& point) { return is_surrounded(point.position, field.corners()); },
                 [](const DirectionalLight&) { return false; }, [](const AreaLight&) { return false; },
                 [](const ConstantLight&) { return false; }, [](const EnvironmentLight&) { return false; }},
      light);
}

/// The area over which undisturbed light is spread where it leaves the volume. From outside, it is the silhouette: by
/// Cauchy, a convex body of area A has the mean silhouette A / 4. From within, it is about the ball around the volume.
double spread_of(const Light& light, const TensorField& field) {
  const Vector3d size = field.world_box().sizes(), middle = field.world_box().center();
  const double ball = size.squaredNorm() * pi;
  if (is_within(light, field)) return ball;
  if (const TriangleMesh* const lamp = emitting_mesh(light))
    if ((lamp->vertices.front() - middle).norm() < size.norm() / 2) return ball / 4;
  return (size.x() * size.y() + size.y() * size.z() + size.z() * size.x()) / 2;
}

/// The radius within which there are enough photons of any light that has some.
double automatic_radius(const TensorField& field, const std::vector<Light>& lights, const PhotonPairs& pairs,
                        std::uint64_t per_pass) {
  double spread = 0;
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (std::find(pairs[i].begin(), pairs[i].end(), true) != pairs[i].end())
      spread = std::max(spread, spread_of(lights[i], field));
  return std::sqrt(photons_in_reach * spread / (pi * static_cast<double>(per_pass)));
}

}  // namespace

PhotonPairs photon_pairs(const LitObjects& lit, const SceneMethodDescription& settings) {
  const TensorField& field = lit.scene.field;
  PhotonPairs pairs(lit.lights.size(), std::vector<bool>(lit.objects.size(), false));
  if (settings.photons.per_pass == 0) return pairs;
  for (std::size_t i = 0; i < lit.lights.size(); ++i) {
    const LightCaustic caustic = caustic_of(lit.scene, i);
    if (const TriangleMesh* const lamp = emitting_mesh(lit.lights[i])) {
      const bool wanted = caustic == LightCaustic::photons || is_small(*lamp, field);
      pairs[i].assign(lit.objects.size(), wanted);
      continue;
    }
    if (!direction_at(lit.lights[i], {}) || caustic == LightCaustic::map) continue;
    const bool always =
        caustic == LightCaustic::photons || settings.conserve == Conserve::radiance || is_within(lit.lights[i], field);
    for (std::size_t k = 0; k < lit.objects.size(); ++k)
      pairs[i][k] =
          always || (lit.objects[k].plate && has_light_on_both_sides(*lit.objects[k].plate, field, lit.lights[i]));
  }
  return pairs;
}

PhotonMaps trace_object_photons(const LitObjects& lit, const PhotonPairs& pairs, const BendingRegion& region,
                                const PhotonsDescription& description, int passes, const Progress& progress) {
  const TensorField& field = lit.scene.field;
  PhotonTracerSettings settings;
  settings.per_pass = description.per_pass;
  if (settings.per_pass == 0) return {};
  settings.passes = passes;
  settings.radius = description.max_radius.value_or(automatic_radius(field, lit.lights, pairs, settings.per_pass));
  settings.seed = lit.scene.description.seed;
  settings.job = lit.job;
  for (const SceneObject& object : lit.objects) settings.plates.push_back(object.plate);
  settings.serves = [&pairs](int light, std::uint32_t surface) {
    const std::vector<bool>& of_light = pairs[static_cast<std::size_t>(light)];
    return surface < of_light.size() && of_light[surface];
  };
  return trace_photons(region, field.corners(), lit.surfaces, lit.lights, settings, progress);
}

}  // namespace tensorray
