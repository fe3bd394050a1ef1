#include "integrators/path_tracing/stage.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "base/constants.h"
#include "renderer/surfaces/plate.h"
#include "scenes/outputs/channel_table.h"

namespace tensorray {
namespace {

constexpr float nothing_depth = 1e10f;  // Depth of pixels that show nothing: behind everything.

/// What is known of a pixel.
struct SurfacePixel {
  const SurfacePicture& picture;
  const PixelState& state;
  std::size_t index;
  Eigen::Vector3f radiance;  ///< In the working space.
  Eigen::Vector3f color;     ///< The same before the background.
  float alpha;               ///< Of `color`.
};

/// A mean over the pixel's samples.
template <int size>
auto mean(PixelMean<size> PixelState::*member) {
  return [member](const SurfacePixel& pixel) { return (pixel.state.*member).get(); };
}

/// A mean over the rays that arrive. @param none  Where no ray does.
auto mean_of_arrived(PixelMean<1> PixelState::*member, float none) {
  return [member, none](const SurfacePixel& pixel) {
    const float arrives = pixel.state.arrives.value[0];
    return arrives > 0 ? (pixel.state.*member).value[0] / arrives : none;
  };
}

/// Red, green and blue of a film's layer.
Eigen::Vector3f layer_color(const Film& film, std::size_t layer, std::size_t index) {
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) color[c] = static_cast<float>(film.plane(static_cast<int>(3 * layer) + c)[index]);
  return color;
}

ChannelTable<SurfacePixel> surface_channels(const SurfacePicture& picture, const std::vector<std::string>& groups) {
  using Pixel = const SurfacePixel&;
  // The picture, and what denoisers and compositors use of the first surface.
  ChannelTable<SurfacePixel> table{
      {{"R", "G", "B"}, [](Pixel pixel) { return pixel.color; }},
      {{"A"}, [](Pixel pixel) { return pixel.alpha; }},
      {{"Z"}, [](Pixel pixel) { return pixel.state.depth.count > 0 ? pixel.state.depth.value[0] : nothing_depth; }},
      {{"normal.X", "normal.Y", "normal.Z"}, mean(&PixelState::normal)},
      {{"albedo.R", "albedo.G", "albedo.B"}, mean(&PixelState::albedo)},
      {{"path"}, [](Pixel pixel) { return pixel.state.path; }},
      {{"force"}, mean(&PixelState::force)},
      {{"length"}, mean(&PixelState::arc_length)},
      {{"samples"}, [](Pixel pixel) { return pixel.state.samples; }},
      {{"variance"}, [](Pixel pixel) { return pixel.state.variance(); }}};
  if (picture.bends) {  // The camera's light.
    table.push_back({{"gain"}, mean_of_arrived(&PixelState::radiance_scale, 1)});
    table.push_back({{"deflection"}, mean_of_arrived(&PixelState::deflection, 0)});
    table.push_back({{"arrives"}, mean(&PixelState::arrives)});
    table.push_back({{"folds"}, mean(&PixelState::folds)});
    table.push_back({{"texture.s", "texture.t"}, mean(&PixelState::texture)});
  }
  if (!picture.landed.values.empty()) {  // Light was traced to surfaces beforehand.
    const auto landed = [](Pixel pixel) { return layer_color(pixel.picture.landed, 0, pixel.index); };
    table.push_back({{"caustic.R", "caustic.G", "caustic.B"}, landed});
    table.push_back({{"straight.R", "straight.G", "straight.B"},
                     [landed](Pixel pixel) -> Eigen::Vector3f { return pixel.radiance - landed(pixel); }});
  }
  for (std::size_t i = 0; i < groups.size(); ++i)
    table.push_back({{groups[i] + ".R", groups[i] + ".G", groups[i] + ".B"},
                     [i](Pixel pixel) { return layer_color(pixel.picture.groups, i, pixel.index); }});
  return table;
}

/// The groups of the scene's lights.
struct LightGroups {
  std::vector<std::string> names;
  std::vector<int> of_light;  // Index of each light's group, or −1.
};

LightGroups light_groups(const SceneDescription& scene) {
  LightGroups groups;
  for (const LightSourceDescription& light : scene.lights) {
    const auto found = std::find(groups.names.begin(), groups.names.end(), light.group);
    groups.of_light.push_back(light.group.empty() ? -1 : static_cast<int>(found - groups.names.begin()));
    if (!light.group.empty() && found == groups.names.end()) groups.names.push_back(light.group);
  }
  return groups;
}

constexpr double sky = 0.55;  // Radiance of the default sky.
constexpr double lamp = 0.6;  // Irradiance / π of the default lamp. A white wall that faces it has radiance 1.15.
constexpr double lamp_degrees = 12;  // Angular diameter of the lamp, for soft shadows.

Camera with_lens(Camera camera, const CameraDescription& description) {
  camera.lens_radius = description.lens_radius;
  if (description.focus_distance) camera.focus_distance = *description.focus_distance;
  return camera;
}

/// A camera that shows the points in the left part of the picture: made for a narrower one, and moved along its plane.
Camera chosen_camera(const CameraDescription& description, const std::vector<Eigen::Vector3d>& points, int free) {
  Framing framing;
  framing.projection = description.projection;
  if (description.direction) framing.direction = *description.direction;
  if (description.up) framing.up = *description.up;
  framing.angle = description.angle;
  framing.resolution = description.resolution - Eigen::Vector2i(free, 0);
  Camera camera = frame_points(points, framing);
  camera.resolution = description.resolution;
  const double pixel = pixel_size(camera, camera.position + camera.focus_distance * camera.forward);
  camera.position += 0.5 * free * pixel * camera.right;
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

PathTracerSettings tracer_settings(const SceneDescription& scene, const PathTracingDescription& description) {
  PathTracerSettings settings;
  settings.shading.shading = description.shading;
  settings.shading.max_depth = description.max_depth;
  double strength = scene.default_lights ? 1 : 0;
  for (const LightSourceDescription& light : scene.lights) strength = std::max(strength, light.strength);
  settings.shading.indirect_clamp = description.indirect_clamp * strength;  // Bright lights must not become darker.
  settings.filter = PixelFilter(description.filter);
  settings.transparent = description.background != Background::lights;
  settings.min_samples = std::min(description.min_samples, description.samples);
  settings.max_samples = description.samples;
  settings.pass_samples = std::max(1, settings.min_samples);
  settings.noise_threshold = settings.min_samples < 2 ? 0 : description.noise;
  if (description.max_seconds) settings.max_seconds = *description.max_seconds;
  settings.spectral = scene.output.wants("spectral");
  settings.seed = scene.seed;
  return settings;
}

std::vector<std::string> surface_channels(const SceneDescription& scene, bool bends) {
  SurfacePicture picture;
  picture.bends = bends;
  if (bends) picture.landed = Film(1, 1, 3);
  return channel_names(surface_channels(picture, light_groups(scene).names));
}

void set_groups(const SceneDescription& scene, ShadedScene& shaded) {
  LightGroups groups = light_groups(scene);
  shaded.groups = static_cast<int>(groups.names.size());
  if (shaded.groups > 0) shaded.group_of_light = std::move(groups.of_light);
}

void set_picture(const SurfacePicture& picture, const ShownLight& light, const PathTracingDescription& description,
                 const SceneDescription& scene, Render& render) {
  const Image colors = color_image(picture.color);
  const ChannelTable<SurfacePixel> table = surface_channels(picture, light_groups(scene).names);
  Image image(colors.width, colors.height, channel_names(table));
  const bool is_colored = description.background == Background::color;
  Eigen::Vector3f background = Eigen::Vector3f::Zero();
  if (is_colored) background = Eigen::Vector3d(light.rec709_to_working * description.background_color).cast<float>();
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    const Eigen::Vector3f radiance(&colors.pixels[3 * i]);
    const float alpha = picture.alpha(i);
    const SurfacePixel pixel{
        picture, picture.pixels[i], i, radiance, radiance + (1 - alpha) * background, is_colored ? 1 : alpha};
    write_channels(table, pixel, &image.pixels[i * image.channels.size()]);
  }
  render.linear = std::move(image);
  if (scene.output.wants("spectral"))
    render.spectral =
        spectral_image(picture.radiance, light.bands, SpectralQuantity::radiance, 1, light.xyz_to_working);
}

RenderCallbacks render_callbacks(const Progress& progress, RenderJob* job, const Render& so_far,
                                 const std::function<void(const SurfacePicture&, Render&)>& add_picture) {
  RenderCallbacks callbacks;
  callbacks.progress = [&progress, job](std::uint64_t done, std::uint64_t total) {
    if (job) job->fraction = static_cast<double>(done) / static_cast<double>(total);
    if (job && progress.cancelled)
      job->stopping = true;
    else
      progress.update("rendering", done, total);
  };
  callbacks.cancelled = &progress.cancelled;
  if (!job) return callbacks;
  callbacks.job = job;
  if (job->show)
    callbacks.show = [job, &so_far, add_picture](const SurfacePicture& picture) {
      Render shown = so_far;
      add_picture(picture, shown);
      job->show(std::move(shown));
    };
  return callbacks;
}

void add_lamps(const std::vector<Light>& lights, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
               std::vector<Material>& materials) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const TriangleMesh* const mesh = emitting_mesh(lights[i]);
    if (!mesh) continue;
    MaterialDescription black;
    black.kind = MaterialKind::diffuse;
    black.color.setZero();
    ShadedSurface surface;
    surface.shape = *mesh;
    surface.light = static_cast<int>(i);
    surface.material = static_cast<int>(materials.size());
    materials.push_back(load_material(black, light));
    surfaces.push_back(std::move(surface));
  }
}

Camera make_camera(const SceneDescription& scene, const std::vector<Eigen::Vector3d>& points, int free) {
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
