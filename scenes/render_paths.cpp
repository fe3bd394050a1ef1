#include "scenes/render_paths.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "integrators/paths/paths.h"
#include "renderer/shading/path_tracer.h"
#include "scenes/context_surfaces.h"
#include "scenes/path_colors.h"
#include "scenes/path_surfaces.h"
#include "scenes/read_scene.h"
#include "scenes/studio.h"

namespace tensorray {
namespace {

constexpr double most_radii = 2e5;      // Rays start a 5e-7th of the diagonal off a surface: a tenth of a radius.
constexpr double legend_width = 0.2;    // Of a picture's width; a chosen camera leaves it free.
constexpr float nothing_depth = 1e10f;  // Where nothing is: behind everything.
constexpr double tube_tolerance = 0.2;  // Pixels: how far a tube's triangles may be off its surface.

/// Paths of a file may have a flexibility that is none of the scene's: they count as the first channel's.
void count_ends(const Scene& scene, const std::vector<Path>& paths, Statistics& statistics) {
  statistics.positions = paths.size();
  statistics.ends.assign(scene.channels.size(), EndCounts{});
  for (const Path& path : paths) {
    const auto found = std::find_if(scene.channels.begin(), scene.channels.end(), [&](const LightChannel& channel) {
      return channel.flexibility == path.flexibility;
    });
    const auto channel = found == scene.channels.end() ? 0 : found - scene.channels.begin();
    ++statistics.ends[static_cast<std::size_t>(channel)][static_cast<std::size_t>(path.end)];
  }
}

std::vector<Path> trace_scene(const Scene& scene, const Progress& progress, Statistics& statistics) {
  const PathTracingDescription& description = scene.description.integrator.paths;
  PathSettings settings;
  settings.backwards = description.backwards;
  settings.outside = description.outside;
  std::vector<Path> paths = scene.paths->seeds.empty() ? scene.paths->paths
                                                       : trace_paths(scene.field, scene.geometry, scene.bending,
                                                                     scene.paths->seeds, settings, progress);
  count_ends(scene, paths, statistics);
  paths.erase(std::remove_if(paths.begin(), paths.end(), [](const Path& path) { return path.points.size() < 2; }),
              paths.end());
  if (paths.empty())
    throw std::runtime_error(scene.description.path.string() +
                             ": no path meets the volume; look at `/integrator/seeds` and `/light/direction`");
  return paths;
}

/// What a camera that nobody has chosen shall see.
std::vector<Eigen::Vector3d> points_of_interest(const Scene& scene, const std::vector<Path>& paths) {
  const ContextDescription& context = scene.description.integrator.paths.context;
  std::vector<Eigen::Vector3d> points;
  for (const Path& path : paths)
    for (const Waypoint& point : path.points) points.push_back(point.position);
  const auto add = [&points](const std::vector<Eigen::Vector3d>& more) {
    points.insert(points.end(), more.begin(), more.end());
  };
  if (context.box || context.slice) add(scene.field.corners());
  if (context.obstacles)
    for (const TriangleMesh& mesh : scene.geometry.surfaces().obstacles) add(mesh.vertices);
  if (context.plate) add(scene.geometry.surfaces().plate->corners());
  return points;
}

Eigen::AlignedBox3d world_box(const TensorField& field) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& corner : field.corners()) box.extend(corner);
  return box;
}

/// How far before the camera the nearest tenth of the paths is: what is nearer may show its triangles.
double near_depth(const std::vector<Path>& paths, const Camera& camera) {
  std::vector<double> depths;
  for (const Path& path : paths)
    for (const Waypoint& point : path.points)
      if (const double depth = (point.position - camera.position).dot(camera.forward); depth > 0)
        depths.push_back(depth);
  if (depths.empty()) return camera.focus_distance;
  const auto tenth = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 10);
  std::nth_element(depths.begin(), tenth, depths.end());
  return *tenth;
}

/// The paths' surface, and their mesh for the scene's `tubes`.
struct PathShapes {
  ShadedSurface surface;
  TubeMesh tubes;  ///< If it is to be written.
};

PathShapes make_shapes(const Scene& scene, const std::vector<Path>& paths, const PathColors& colors,
                       const Camera& camera) {
  const PathTracingDescription& description = scene.description.integrator.paths;
  const double typical = typical_radius(description.radius, paths.size(), world_box(scene.field));
  const double pixel = pixel_size(camera, camera.position + near_depth(paths, camera) * camera.forward);
  const Eigen::Matrix3d& to_working = scene.paths->light.rec709_to_working;
  PathShapes shapes;
  TubeMesh mesh;
  const bool writes = !scene.description.output.tubes.empty();
  if (writes || description.style != PathStyle::lines)
    mesh = path_mesh(paths, description, colors, typical, tube_tolerance * pixel);
  if (writes) shapes.tubes = mesh;
  shapes.surface = description.style == PathStyle::lines
                       ? line_surface(paths, description.radius.typical.value_or(0.75 * pixel), colors, to_working)
                       : path_surface(std::move(mesh), paths, colors, to_working);
  return shapes;
}

Camera scene_camera(const Scene& scene, const std::vector<Path>& paths, double free) {
  try {
    return make_camera(scene.description.camera, points_of_interest(scene, paths), free);
  } catch (const std::invalid_argument& error) {
    throw SceneError(fmt::format("{}: `/camera`: {}", scene.description.path.string(), error.what()));
  }
}

PathTracerSettings tracer_settings(const SceneDescription& scene) {
  const PathTracingDescription& description = scene.integrator.paths;
  PathTracerSettings settings;
  settings.shading.shading = description.shading;
  settings.shading.max_depth = description.max_depth;
  double strength = scene.lights.empty() ? 1 : 0;
  for (const LightSourceDescription& light : scene.lights) strength = std::max(strength, light.strength);
  settings.shading.indirect_clamp *= strength;  // A brighter light is no firefly.
  settings.filter = PixelFilter(description.filter);
  settings.transparent = description.background != Background::lights;
  settings.min_samples = std::min(description.min_samples, description.samples);
  settings.max_samples = description.samples;
  settings.pass_samples = std::max(1, settings.min_samples);
  settings.noise_threshold = settings.min_samples < 2 ? 0 : description.noise;
  settings.seed = scene.seed;
  return settings;
}

/// R, G, B, A, and what denoisers and compositors use.
Image make_image(const SurfacePicture& picture, const ShownLight& light, const PathTracingDescription& description) {
  const Image colors = linear_image(picture.radiance, light.bands, light.xyz_to_working);
  Image image(colors.width, colors.height,
              {"R", "G", "B", "A", "Z", "normal.X", "normal.Y", "normal.Z", "albedo.R", "albedo.G", "albedo.B", "path",
               "force", "length", "samples", "variance"});
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
  }
  return image;
}

/// Area lights are seen as well.
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

/// Refuses what lies so far away that the renderer's precision, which goes by the size of everything, loses the paths.
void require_fine(const Scene& scene, const SurfaceScene& stage, const std::vector<Path>& paths) {
  const double typical =
      typical_radius(scene.description.integrator.paths.radius, paths.size(), world_box(scene.field));
  if (stage.bounds().diagonal().norm() < most_radii * typical) return;
  throw SceneError(fmt::format(
      "{}: what is drawn is {:.3g} long, and paths are {:.3g} thick: too fine for it; bring lamps, obstacles and plate "
      "nearer, or raise `/integrator/radius/typical`",
      scene.description.path.string(), stage.bounds().diagonal().norm(), typical));
}

}  // namespace

Render render_paths(const Scene& scene, const Progress& progress) {
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  const PathTracingDescription& description = scene.description.integrator.paths;
  const ShownLight& light = scene.paths->light;
  const auto start = Clock::now();
  Render result;
  result.paths = trace_scene(scene, progress, result.statistics);
  result.statistics.seconds_tracing = seconds_since(start);

  const auto drawing = Clock::now();
  const PathColors colors = path_colors(description.color, result.paths);
  const bool has_legend = description.color.legend && colors.legend;
  const Camera camera = scene_camera(scene, result.paths, has_legend ? legend_width : 0);
  PathShapes shapes = make_shapes(scene, result.paths, colors, camera);
  std::vector<Material> materials{load_material(description.material, light)};
  std::vector<ShadedSurface> surfaces{std::move(shapes.surface)};
  add_context(scene, progress, surfaces, materials);
  const std::vector<Light> lights = make_lights(scene.description, *scene.paths, camera);
  add_lamps(lights, light, surfaces, materials);
  const SurfaceScene stage(std::move(surfaces));
  require_fine(scene, stage, result.paths);
  std::vector<float> luminance;
  for (const Band& band : light.bands) luminance.push_back(static_cast<float>(band.xyz.y()));
  const LightSampler sampler(lights, luminance, stage.bounds());
  const ReflectanceTable table(light.model, light.bands, light.xyz_to_working);
  RenderCallbacks callbacks;
  callbacks.progress = [&](std::uint64_t done, std::uint64_t total) { progress.update("rendering", done, total); };
  const SurfacePicture picture =
      render_surfaces({stage, materials, sampler, table}, camera, tracer_settings(scene.description), callbacks);
  result.linear = make_image(picture, light, description);
  if (!scene.description.output.spectral.empty())
    result.spectral = spectral_image(picture.radiance, light.bands, 1, light.xyz_to_working);
  result.statistics.seconds_drawing = seconds_since(drawing);
  result.exposure = 0;
  if (has_legend)
    result.annotate = [legend = colors.legend, matrix = light.rec709_to_working](Image& image) {
      legend(image, matrix);
    };
  if (!scene.description.output.tubes.empty())
    result.write_tubes = [tubes = std::move(shapes.tubes), colors](const std::filesystem::path& path,
                                                                   const std::vector<Path>& paths) {
      write_tubes(path, tubes, paths, colors);
    };
  return result;
}

}  // namespace tensorray
