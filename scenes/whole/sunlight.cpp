#include "scenes/whole/sunlight.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "integrators/flow/landed_irradiance.h"
#include "scenes/path_tracing/studio.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double sky_strength = 0.35;
const Vector3d sky_color(0.62, 0.78, 1);
constexpr double sun_strength = 1;
constexpr double sun_degrees = 0.53;  // Angular diameter.
const Vector3d high_sun(0.35, 0.25, -1);

std::vector<Light> default_lights(const Scene& scene, const ShownLight& shown) {
  const Vector3d& along = scene.beam.direction;
  DirectionalLight sun;
  sun.direction = along.z() < -0.3 ? along : high_sun;
  sun.irradiance = shown.radiance(Vector3d::Ones(), pi * sun_strength);
  sun.angle = sun_degrees / 2 * pi / 180;
  return {ConstantLight{shown.radiance(sky_color, sky_strength)}, sun};
}

/// All surfaces that stop light on its way to object `receiver`, and the object itself, if it is no plate. Paths show
/// light, and do not stop it.
Surfaces surfaces_before(const Scene& scene, const std::vector<SceneObject>& objects, std::size_t receiver) {
  Surfaces surfaces;
  surfaces.bounds = scene.geometry.surfaces().bounds;
  surfaces.cut = scene.geometry.surfaces().cut;
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (i != receiver && !objects[i].paths) surfaces.obstacles.push_back(objects[i].mesh());
  if (!objects[receiver].plate) surfaces.body = objects[receiver].mesh();
  return surfaces;
}

DistantLight distant_light(const DirectionalLight& light, const ShownLight& shown, const BendingDescription& bending,
                           int passes) {
  DistantLight result;
  result.direction = light.direction.normalized();
  result.angle = light.angle;
  result.passes = light.angle > 0 ? passes : 1;
  const auto flexibility = flexibility_of(bending);
  for (const Band& band : shown.bands) result.flexibilities.push_back(flexibility(band.wavelength - band.width / 2));
  result.flexibilities.push_back(flexibility(shown.bands.back().wavelength + shown.bands.back().width / 2));
  return result;
}

/// The side of the plate that faces the middle of the volume; if the plate goes through the middle, that of the light.
double lit_side(const Plate& plate, const TensorField& field, const Vector3d& direction) {
  const double height = plate.normal().dot(field.world_box().center() - plate.center);
  const bool is_middle = std::abs(height) < 1e-9 * field.world_box().diagonal().norm();
  return (is_middle ? -plate.normal().dot(direction) : height) < 0 ? -1 : 1;
}

/// A plane behind a body that faces the light; each point of the body has its place on it.
Plate plane_behind(const TriangleMesh& body, const Vector3d& direction) {
  Plate plate;
  plate.up = upright(direction, Vector3d::UnitZ());
  plate.right = plate.up.cross(-direction);
  Eigen::AlignedBox3d box;  // Along right, up, and the light.
  for (const Vector3d& vertex : body.vertices)
    box.extend(Vector3d(plate.right.dot(vertex), plate.up.dot(vertex), direction.dot(vertex)));
  plate.center = box.center().x() * plate.right + box.center().y() * plate.up + box.max().z() * direction;
  plate.size = box.sizes().head<2>();
  return plate;
}

LandedLight landed_light(const LandedIrradiance& landed, const DirectionalLight& light) {
  LandedLight result;
  result.plate = landed.plate;
  result.towards = -light.direction.normalized();
  result.bands = landed.irradiance.channels;
  const std::size_t pixels = landed.irradiance.plane_size(), bands = light.irradiance.size();
  result.irradiance.resize(pixels * bands);
  for (std::size_t band = 0; band < bands; ++band) {
    const double* plane = landed.irradiance.plane(static_cast<int>(band));
    for (std::size_t i = 0; i < pixels; ++i)
      result.irradiance[i * bands + band] = static_cast<float>(plane[i] * light.irradiance[band]);
  }
  return result;
}

/// Gives light to one side of a plate. Light that grazes it straight may come from above it when it is bent.
void face(double side, LandedLight& light) {
  light.side = side;
  const Vector3d normal = side * light.plate.normal();
  if (!(light.towards.dot(normal) > 0.05)) light.towards = normal;
}

}  // namespace

std::vector<Light> whole_lights(const Scene& scene, const ShownLights& shown, const Camera& camera) {
  if (scene.description.lights.empty()) return default_lights(scene, shown.light);
  return make_lights(scene.description, shown, camera);
}

std::function<double(double)> flexibility_of(const BendingDescription& bending) {
  if (!bending.rgb)
    return [flexibility = bending.flexibility](double wavelength) { return flexibility.at(wavelength); };
  return [rgb = *bending.rgb](double wavelength) {
    const int from = wavelength > 550 ? 0 : 1;
    const double part = (650 - 100 * from - wavelength) / 100;
    return (1 - part) * rgb[from] + part * rgb[from + 1];
  };
}

std::vector<LandedLight> land_light(const Scene& scene, const std::vector<Light>& lights, const ShownLight& shown,
                                    const std::vector<SceneObject>& objects, const CausticDescription& caustic,
                                    const Progress& progress) {
  std::vector<LandedLight> result;
  for (const Light& each : lights) {
    const auto* light = std::get_if<DirectionalLight>(&each);
    if (!light) continue;
    const DistantLight distant = distant_light(*light, shown, scene.description.bending, caustic.passes);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (objects[i].mesh().triangles.empty()) continue;
      Plate plate = objects[i].plate ? *objects[i].plate : plane_behind(objects[i].mesh(), distant.direction);
      plate.resolution.setConstant(caustic.resolution);
      const auto landed = landed_irradiance(scene.field, surfaces_before(scene, objects, i), plate, distant,
                                            scene.bending, caustic.resolution, caustic.rays, progress);
      if (!landed) continue;
      result.push_back(landed_light(*landed, *light));
      result.back().surface = static_cast<std::uint32_t>(i);
      if (objects[i].plate)
        face(lit_side(plate, scene.field, distant.direction), result.back());
      else
        result.back().body = std::make_shared<SurfaceScene>(std::vector{objects[i].surface});
    }
  }
  return result;
}

}  // namespace tensorray
