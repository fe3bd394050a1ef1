#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "base/constants.h"
#include "integrators/path_tracing/stage.h"
#include "renderer/surfaces/plate.h"

namespace tensorray {
namespace {

constexpr double sky = 0.55;  // Radiance of the default sky.
constexpr double lamp = 0.6;  // Irradiance / π of the default lamp. A white wall that faces it has radiance 1.15.
constexpr double lamp_degrees = 12;  // Angular diameter of the lamp, for soft shadows.

Camera with_lens(Camera camera, const CameraDescription& description) {
  camera.lens_radius = description.lens_radius;
  if (description.focus_distance) camera.focus_distance = *description.focus_distance;
  return camera;
}

/// A camera that shows the points in the left part of the picture. It is made for a narrower picture and then moved
/// along the plane of the picture.
Camera chosen_camera(const CameraDescription& description, const std::vector<Eigen::Vector3d>& points, double free) {
  const double free_pixels = std::floor(free * description.resolution.x());
  Framing framing;
  framing.projection = description.projection;
  if (description.direction) framing.direction = *description.direction;
  if (description.up) framing.up = *description.up;
  framing.angle = description.angle;
  framing.resolution = description.resolution - Eigen::Vector2i(static_cast<int>(free_pixels), 0);
  Camera camera = frame_points(points, framing);
  camera.resolution = description.resolution;
  const double pixel = pixel_size(camera, camera.position + camera.focus_distance * camera.forward);
  camera.position += free_pixels / 2 * pixel * camera.right;
  return camera;
}

/// The camera of the scene, which has a position.
Camera given_camera(const CameraDescription& description, const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  const Eigen::Vector3d target = description.target.value_or(box.center());
  const Eigen::Vector3d up = description.up.value_or(Eigen::Vector3d::UnitZ());
  if (description.projection == Projection::perspective)
    return perspective_camera(*description.position, target, up, description.angle, description.resolution);
  const double height = description.height.value_or(1.1 * box.diagonal().norm());
  return orthographic_camera(*description.position, target, up, height, description.resolution);
}

/// @param environments  Of the lights before this one; changed.
Light make_light(const LightSourceDescription& light, const ShownLights& all, std::size_t& environments) {
  const ShownLight& shown = all.light;
  switch (light.kind) {
    case LightKind::directional: {
      DirectionalLight result;
      if (light.direction) result.direction = *light.direction;
      result.irradiance = shown.radiance(light.color, pi * light.strength);
      result.angle = light.angle / 2 * pi / 180;
      return result;
    }
    case LightKind::area: {
      const Eigen::Vector3d normal = light.direction.value_or(-Eigen::Vector3d::UnitZ()).normalized();
      const Eigen::Vector3d up = upright(normal, Eigen::Vector3d::UnitZ());
      return AreaLight{rectangle_mesh(light.center.value(), up.cross(normal), up, light.size),
                       shown.radiance(light.color, light.strength)};
    }
    case LightKind::point:
      return PointLight{light.position.value(), shown.radiance(light.color, pi * light.strength)};
    case LightKind::environment:
      return all.environments[environments++];
    case LightKind::constant:
      return ConstantLight{shown.radiance(light.color, light.strength)};
  }
  throw std::logic_error("unknown kind of light");
}

}  // namespace

Camera make_camera(const SceneDescription& scene, const std::vector<Eigen::Vector3d>& points, double free) {
  try {
    return with_lens(
        scene.camera.position ? given_camera(scene.camera, points) : chosen_camera(scene.camera, points, free),
        scene.camera);
  } catch (const std::invalid_argument& error) {
    throw SceneError(fmt::format("{}: `/camera`: {}", scene.path.string(), error.what()));
  }
}

std::vector<Light> make_lights(const SceneDescription& description, const ShownLights& shown, const Camera& camera) {
  if (description.default_lights) {
    const Eigen::Vector3d white = Eigen::Vector3d::Ones();
    DirectionalLight key;
    key.direction = camera.forward + 0.6 * camera.right - 0.9 * camera.up;
    key.irradiance = shown.light.radiance(white, pi * lamp);
    key.angle = lamp_degrees / 2 * pi / 180;
    return {ConstantLight{shown.light.radiance(white, sky)}, key};
  }
  std::vector<Light> lights;
  std::size_t environments = 0;
  for (const LightSourceDescription& light : description.lights)
    lights.push_back(make_light(light, shown, environments));
  return lights;
}

}  // namespace tensorray
