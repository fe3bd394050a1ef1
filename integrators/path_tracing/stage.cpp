#include "integrators/path_tracing/stage.h"

#include <algorithm>
#include <utility>

#include "integrators/path_tracing/context_surfaces.h"
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

/// Red, green and blue of a film's layer.
Eigen::Vector3f layer_color(const Film& film, std::size_t layer, std::size_t index) {
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) color[c] = static_cast<float>(film.plane(static_cast<int>(3 * layer) + c)[index]);
  return color;
}

/// The picture, and what denoisers and compositors use of the first surface.
ChannelTable<SurfacePixel> first_surface_channels() {
  using Pixel = const SurfacePixel&;
  return {
      {{"R", "G", "B"},
       "The picture, scene-linear: 1 is white. If `background` is `transparent`, multiplied by A.",
       [](Pixel pixel) { return pixel.color; }},
      {{"A"},
       "The part of the pixel that shows something; 1 unless `background` is `transparent`.",
       [](Pixel pixel) { return pixel.alpha; }},
      {{"Z"},
       "Distance along the view, world units; 1e10 where nothing is seen.",
       [](Pixel pixel) { return pixel.picture.alpha(pixel.index) > 0 ? pixel.state.depth.value[0] : nothing_depth; }},
      {{"normal.X", "normal.Y", "normal.Z"}, "In world space, towards the viewer.", mean(&PixelState::normal)},
      {{"albedo.R", "albedo.G", "albedo.B"}, "The surface's own colour, without light.", mean(&PixelState::albedo)},
      {{"path"},
       "The number of the path nearest to the pixel's centre; −1: none. Paths that meet the volume are numbered from 0 "
       "in the order of their seeds.",
       [](Pixel pixel) { return pixel.state.path; }},
      {{"force"}, "‖T V‖ of the path, in the unit of T.", mean(&PixelState::force)},
      {{"length"}, "The length from the beginning of the path, world units.", mean(&PixelState::arc_length)},
      {{"samples"}, "The number of samples that the pixel has taken.", [](Pixel pixel) { return pixel.state.samples; }},
      {{"variance"}, "Of the pixel's luminance: the square of its standard error.", [](Pixel pixel) {
         return pixel.state.variance();
       }}};
}

/// @param bends, has_landed  Whether the camera's light bends, and whether light was traced to surfaces beforehand.
ChannelTable<SurfacePixel> bent_light_channels(bool bends, bool has_landed) {
  using Pixel = const SurfacePixel&;
  return {
      {{"gain"},
       "The mean factor on radiance; 1 where the camera's light is straight.",
       mean(&PixelState::radiance_scale),
       bends},
      {{"deflection"},
       "The mean angle by which the camera's light is turned, radians.",
       mean(&PixelState::deflection),
       bends},
      {{"arrives"}, "The part of the bent rays that could be traced to their ends.", mean(&PixelState::arrives), bends},
      {{"folds"},
       "The number of sheets of a light that lie on each other where it has landed.",
       mean(&PixelState::folds),
       bends},
      {{"texture.s", "texture.t"},
       "The place in a plate's texture: (0, 0) is its lower left, (1, 1) its upper right corner.",
       mean(&PixelState::texture),
       bends},
      {{"caustic.R", "caustic.G", "caustic.B"},
       "If the field throws light on objects: all light that they have received from directional lights and points "
       "through the volume.",
       [](Pixel pixel) { return layer_color(pixel.picture.landed, 0, pixel.index); },
       has_landed},
      {{"straight.R", "straight.G", "straight.B"},
       "The picture without `caustic`.",
       [](Pixel pixel) -> Eigen::Vector3f {
         return pixel.radiance - layer_color(pixel.picture.landed, 0, pixel.index);
       },
       has_landed}};
}

ChannelTable<SurfacePixel> surface_channels(const SurfacePicture& picture, const std::vector<std::string>& groups) {
  ChannelTable<SurfacePixel> table = first_surface_channels();
  for (auto& row : bent_light_channels(picture.bends, !picture.landed.values.empty())) table.push_back(std::move(row));
  for (std::size_t i = 0; i < groups.size(); ++i)
    table.push_back({{groups[i] + ".R", groups[i] + ".G", groups[i] + ".B"},
                     "The part of the picture that the `lights` of a `group` of this name light.",
                     [i](const SurfacePixel& pixel) { return layer_color(pixel.picture.groups, i, pixel.index); }});
  return table;
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
  settings.seed = scene.seed;
  return settings;
}

LightGroups light_groups(const SceneDescription& scene) {
  LightGroups groups;
  for (const LightSourceDescription& light : scene.lights) {
    const auto found = std::find(groups.names.begin(), groups.names.end(), light.group);
    groups.of_light.push_back(light.group.empty() ? -1 : static_cast<int>(found - groups.names.begin()));
    if (!light.group.empty() && found == groups.names.end()) groups.names.push_back(light.group);
  }
  return groups;
}

void set_groups(const LightGroups& groups, ShadedScene& scene) {
  scene.groups = static_cast<int>(groups.names.size());
  if (scene.groups > 0) scene.group_of_light = groups.of_light;
}

std::vector<ChannelText> surface_channel_texts(bool bent) {
  std::vector<ChannelText> texts;
  for (const ChannelRow<SurfacePixel>& row : surface_channels({}, {"GROUP"}))
    if (row.is_there != bent) texts.push_back(row);
  return texts;
}

Image make_image(const SurfacePicture& picture, const ShownLight& light, const PathTracingDescription& description,
                 const LightGroups& groups) {
  const Image colors = linear_image(picture.radiance, light.bands, light.xyz_to_working);
  const ChannelTable<SurfacePixel> table = surface_channels(picture, groups.names);
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
  return image;
}

RenderCallbacks callbacks_of(const Progress& progress, RenderJob* job,
                             const std::function<Render(const SurfacePicture&)>& finish) {
  RenderCallbacks callbacks;
  callbacks.progress = [&progress, job](std::uint64_t done, std::uint64_t total) {
    if (job) job->fraction = static_cast<double>(done) / static_cast<double>(total);
    if (job && progress.cancelled)
      job->stopping = true;
    else
      progress.update("rendering", done, total);
  };
  if (!job) return callbacks;
  callbacks.job = job;
  if (job->show) callbacks.show = [job, finish](const SurfacePicture& picture) { job->show(finish(picture)); };
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

}  // namespace tensorray
