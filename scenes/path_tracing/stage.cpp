#include "scenes/path_tracing/stage.h"

#include <algorithm>
#include <utility>

#include "scenes/path_tracing/context_surfaces.h"

namespace tensorray {
namespace {

constexpr float nothing_depth = 1e10f;  // Depth of pixels that show nothing: behind everything.

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

Image make_image(const SurfacePicture& picture, const ShownLight& light, const PathTracingDescription& description,
                 const LightGroups& groups) {
  const Image colors = linear_image(picture.radiance, light.bands, light.xyz_to_working);
  std::vector<std::string> channels{"R",        "G",        "B",        "A",        "Z",        "normal.X",
                                    "normal.Y", "normal.Z", "albedo.R", "albedo.G", "albedo.B", "path",
                                    "force",    "length",   "samples",  "variance"};
  if (!picture.gain.empty())
    channels.insert(channels.end(), {"gain", "deflection", "arrives", "folds", "texture.s", "texture.t"});
  std::vector<std::string> layers;
  if (!picture.landed.values.empty()) layers = {"caustic", "straight"};
  layers.insert(layers.end(), groups.names.begin(), groups.names.end());
  for (const std::string& layer : layers)
    for (const char* color : {".R", ".G", ".B"}) channels.push_back(layer + color);
  Image image(colors.width, colors.height, std::move(channels));
  const Eigen::Vector3d background = description.background == Background::color
                                         ? Eigen::Vector3d(light.rec709_to_working * description.background_color)
                                         : Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < picture.alpha.size(); ++i) {
    float* out = &image.pixels[i * image.channels.size()];
    const float alpha = picture.alpha[i];
    for (int c = 0; c < 3; ++c)
      *out++ = colors.pixels[3 * i + static_cast<std::size_t>(c)] + (1 - alpha) * static_cast<float>(background[c]);
    *out++ = description.background == Background::color ? 1 : alpha;
    *out++ = alpha > 0 ? picture.depth[i] : nothing_depth;
    for (int c = 0; c < 3; ++c) *out++ = picture.normal[i][c];
    for (int c = 0; c < 3; ++c) *out++ = picture.albedo[i][c];
    for (const float value :
         {picture.path[i], picture.force[i], picture.arc_length[i], picture.samples[i], picture.variance[i]})
      *out++ = value;
    if (!picture.gain.empty())
      for (const float value : {picture.gain[i], picture.deflection[i], picture.arrives[i], picture.folds[i],
                                picture.texture[i].x(), picture.texture[i].y()})
        *out++ = value;
    for (int c = 0; c < picture.landed.channels; ++c) *out++ = static_cast<float>(picture.landed.plane(c)[i]);
    for (int c = 0; c < picture.landed.channels; ++c)
      *out++ = colors.pixels[3 * i + static_cast<std::size_t>(c)] - static_cast<float>(picture.landed.plane(c)[i]);
    for (int c = 0; c < picture.groups.channels; ++c) *out++ = static_cast<float>(picture.groups.plane(c)[i]);
  }
  return image;
}

RenderCallbacks callbacks_of(const Progress& progress, RenderJob* job,
                             const std::function<Render(const SurfacePicture&)>& finish) {
  RenderCallbacks callbacks;
  callbacks.progress = [&progress, job](std::uint64_t done, std::uint64_t total) {
    if (job) job->work.fraction = static_cast<double>(done) / static_cast<double>(total);
    if (job && progress.cancelled)
      job->work.stopping = true;
    else
      progress.update("rendering", done, total);
  };
  if (!job) return callbacks;
  callbacks.work = &job->work;
  if (job->show) callbacks.show = [job, finish](const SurfacePicture& picture) { job->show(finish(picture)); };
  return callbacks;
}

void add_lamps(const std::vector<Light>& lights, const ShownLight& light, std::vector<ShadedSurface>& surfaces,
               std::vector<Material>& materials) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto* area = std::get_if<AreaLight>(&lights[i]);
    if (!area) continue;
    MaterialDescription black;
    black.kind = MaterialKind::diffuse;
    black.color.setZero();
    ShadedSurface surface;
    surface.shape = area->mesh;
    surface.light = static_cast<int>(i);
    surface.material = static_cast<int>(materials.size());
    materials.push_back(load_material(black, light));
    surfaces.push_back(std::move(surface));
  }
}

}  // namespace tensorray
