#include <cmath>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "base/constants.h"
#include "base/overloaded.h"
#include "integrators/path_tracing/stage.h"
#include "integrators/scene/field_light.h"
#include "tracing/flow_drawing/flow_irradiance.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double sky_strength = 0.26;
const Vector3d sky_color(0.62, 0.78, 1);
constexpr double sun_strength = 0.75;  // White squares are just below white.
constexpr double sun_degrees = 0.53;   // Angular diameter.
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
Surfaces surfaces_before(const LitObjects& lit, std::size_t receiver) {
  const std::vector<ShadedSurface>& all = lit.surfaces.surfaces();
  Surfaces surfaces;
  surfaces.bounds = lit.scene.geometry.surfaces().bounds;
  surfaces.cut = lit.scene.geometry.surfaces().cut;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i != receiver && !(i < lit.objects.size() && lit.objects[i].paths))
      surfaces.obstacles.push_back(std::get<TriangleMesh>(all[i].shape));
  if (!lit.objects[receiver].plate) surfaces.body = lit.objects[receiver].mesh();
  return surfaces;
}

/// Parallel light, that of a disk, and that of a point; nothing for other lights.
std::optional<LandingLight> landing_light(const Light& light, const ShownLight& shown,
                                          const BendingDescription& bending, int passes) {
  LandingLight result;
  const auto from_sun = [&](const DirectionalLight& sun) {
    result.direction = sun.direction.normalized();
    result.angle = sun.angle;
    result.passes = sun.angle > 0 ? passes : 1;
    return true;
  };
  const auto from_point = [&](const PointLight& point) {
    result.source = point.position;
    return true;
  };
  const bool lands =
      std::visit(Overloaded{from_sun, from_point, [](const AreaLight&) { return false; },
                            [](const ConstantLight&) { return false; }, [](const EnvironmentLight&) { return false; }},
                 light);
  if (!lands) return std::nullopt;
  const auto flexibility = flexibility_of(bending);
  for (const Band& band : shown.bands) result.flexibilities.push_back(flexibility(band.wavelength - band.width / 2));
  result.flexibilities.push_back(flexibility(shown.bands.back().wavelength + shown.bands.back().width / 2));
  return result;
}

/// The side of the plate that faces the middle of the volume; if the plate goes through the middle, that of the light.
double lit_side(const Plate& plate, const TensorField& field, const LandingLight& light) {
  const Vector3d middle = field.world_box().center();
  const Vector3d direction = light.source ? Vector3d(middle - *light.source) : light.direction;
  const double height = plate.normal().dot(middle - plate.center);
  const bool is_middle = std::abs(height) < 1e-9 * field.world_box().diagonal().norm();
  return (is_middle ? -plate.normal().dot(direction) : height) < 0 ? -1 : 1;
}

/// A plane behind a body that faces the light; each point of the body has its place on it.
Plate plane_behind(const TriangleMesh& body, const LandingLight& light) {
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& vertex : body.vertices) bounds.extend(vertex);
  const Vector3d direction = light.source ? Vector3d((bounds.center() - *light.source).normalized()) : light.direction;
  Plate plate;
  plate.up = upright(direction, Vector3d::UnitZ());
  plate.right = plate.up.cross(-direction);
  Eigen::AlignedBox3d box;  // Along right, up, and the light.
  for (const Vector3d& vertex : body.vertices)
    box.extend(Vector3d(plate.right.dot(vertex), plate.up.dot(vertex), direction.dot(vertex)));
  plate.center = box.center().x() * plate.right + box.center().y() * plate.up + box.max().z() * direction;
  plate.size = box.sizes().head<2>();
  if (!light.source) return plate;
  Eigen::AlignedBox2d seen;
  for (const Vector3d& vertex : body.vertices) {
    const Vector3d place = projected_from(*light.source, plate, vertex) - plate.center;
    seen.extend(Eigen::Vector2d(plate.right.dot(place), plate.up.dot(place)));
  }
  plate.center += seen.center().x() * plate.right + seen.center().y() * plate.up;
  plate.size = seen.sizes();
  return plate;
}

/// @param strength  In every band.
IrradianceMap irradiance_map(const FlowIrradiance& landed, const LandingLight& light,
                             const std::vector<float>& strength) {
  IrradianceMap result;
  result.plate = landed.plate;
  result.source = light.source;
  result.towards = -light.direction;
  result.bands = landed.irradiance.channels;
  result.folds = landed.folds;
  result.straight = landed.straight;
  const std::size_t pixels = landed.irradiance.plane_size(), bands = strength.size();
  result.irradiance.resize(pixels * bands);
  for (std::size_t band = 0; band < bands; ++band) {
    const double* plane = landed.irradiance.plane(static_cast<int>(band));
    for (std::size_t i = 0; i < pixels; ++i)
      result.irradiance[i * bands + band] = static_cast<float>(plane[i] * strength[band]);
  }
  return result;
}

/// Gives light to one side of a plate.
void face(double side, IrradianceMap& light) {
  light.side = side;
  const Vector3d normal = side * light.plate.normal();
  if (!(light.towards.dot(normal) > grazing_cosine)) light.towards = normal;
}

/// The light with this number on an object; nothing if none lands. @throw SceneError if it is where it cannot be.
std::optional<IrradianceMap> land(const LitObjects& lit, std::size_t number, const LandingLight& light,
                                  std::size_t receiver, const CausticDescription& caustic, const Progress& progress) {
  const Scene& scene = lit.scene;
  const SceneObject& object = lit.objects[receiver];
  Plate plate = object.plate ? *object.plate : plane_behind(object.mesh(), light);
  plate.resolution.setConstant(caustic.resolution);
  std::optional<FlowIrradiance> landed;
  try {
    landed = flow_irradiance(
        scene.field, surfaces_before(lit, receiver), plate, light,
        {scene.bending, caustic.resolution, caustic.rays, lit.job, number * lit.objects.size() + receiver}, progress);
  } catch (const std::invalid_argument& error) {
    throw SceneError(fmt::format("{}: `/lights/{}` has no map of its light: {}; move it away, or use photons",
                                 scene.description.path.string(), number, error.what()));
  }
  if (!landed) return std::nullopt;
  IrradianceMap map = irradiance_map(*landed, light, *thrown_light(lit.lights[number]));
  map.surface = static_cast<std::uint32_t>(receiver);
  map.light = static_cast<int>(number);
  if (object.plate)
    face(lit_side(plate, scene.field, light), map);
  else
    map.body = std::make_shared<SurfaceScene>(std::vector{object.surface});
  return map;
}

}  // namespace

std::vector<Light> scene_lights(const Scene& scene, const ShownLights& shown, const Camera& camera) {
  if (scene.description.default_lights) return default_lights(scene, shown.light);
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

std::vector<IrradianceMap> land_light(const LitObjects& lit, const PhotonPairs& photons, const ShownLight& shown,
                                      const CausticDescription& caustic, const Progress& progress) {
  std::vector<IrradianceMap> maps;
  for (std::size_t number = 0; number < lit.lights.size(); ++number) {
    const auto light = landing_light(lit.lights[number], shown, lit.scene.description.bending, caustic.passes);
    if (!light) continue;
    for (std::size_t i = 0; i < lit.objects.size(); ++i)
      if (!photons[number][i] && !lit.objects[i].mesh().triangles.empty())
        if (auto map = land(lit, number, *light, i, caustic, progress)) maps.push_back(std::move(*map));
  }
  return maps;
}

}  // namespace tensorray
