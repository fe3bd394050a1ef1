#include "integrators/path_tracing/path_tracing_method.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/process/progress.h"
#include "base/process/seconds.h"
#include "integrators/path_files/path_files.h"
#include "integrators/path_tracing/path_colors.h"
#include "integrators/path_tracing/stage.h"
#include "renderer/camera/path_tracer.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/picture_outputs.h"
#include "tracing/paths/paths.h"

namespace tensorray {
namespace {

constexpr double max_radii = 2e5;  // Rays start 5e-7 diagonals away from a surface, which is then a tenth of a radius.
constexpr double most_legend = 0.3;     // Of the picture's width, that a chosen camera leaves free.
constexpr double tube_tolerance = 0.2;  // Pixels: greatest distance of a tube's triangles from its surface.

/// The points that a camera without a given position must show.
std::vector<Eigen::Vector3d> points_of_interest(const Scene& scene, const ContextDescription& context,
                                                const std::vector<Path>& paths) {
  std::vector<Eigen::Vector3d> points;
  for (const Path& path : paths)
    for (const PathPoint& point : path.points) points.push_back(point.position);
  const auto add = [&points](const std::vector<Eigen::Vector3d>& more) {
    points.insert(points.end(), more.begin(), more.end());
  };
  if (context.box || context.slice) add(scene.field.corners());
  if (context.obstacles)
    for (const TriangleMesh& mesh : scene.geometry.surfaces().obstacles) add(mesh.vertices);
  if (context.body > 0 && scene.geometry.has_cut()) add(scene.geometry.surfaces().cut->vertices);
  if (context.plate) add(scene.geometry.surfaces().plate->corners());
  return points;
}

/// A tenth of the path points before the camera are nearer than this depth. Triangles may be visible there.
double near_depth(const std::vector<Path>& paths, const Camera& camera) {
  std::vector<double> depths;
  for (const Path& path : paths)
    for (const PathPoint& point : path.points)
      if (const double depth = (point.position - camera.position).dot(camera.forward); depth > 0)
        depths.push_back(depth);
  if (depths.empty()) return camera.focus_distance;
  const auto tenth = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 10);
  std::nth_element(depths.begin(), tenth, depths.end());
  return *tenth;
}

/// The surface of the paths, and their mesh for the output `tubes`.
struct PathShapes {
  ShadedSurface surface;
  TubeMesh tubes;  ///< Empty if it is not written.
};

PathShapes make_shapes(const Scene& scene, const PathScene& path_scene, const std::vector<Path>& paths,
                       const PathColors& colors, const Camera& camera) {
  const PathTracingDescription& description = path_scene.settings;
  const double typical = typical_radius(description.radius, paths.size(), scene.field.world_box());
  const double pixel = pixel_size(camera, camera.position + near_depth(paths, camera) * camera.forward);
  const Eigen::Matrix3d& to_working = path_scene.lights.light.rec709_to_working;
  PathShapes shapes;
  TubeMesh mesh;
  const bool writes = scene.description.output.wants("tubes");
  if (writes || description.style != PathStyle::lines)
    mesh = path_mesh(paths, description, colors, typical, tube_tolerance * pixel);
  if (writes) shapes.tubes = mesh;
  shapes.surface = description.style == PathStyle::lines
                       ? line_surface(paths, description.radius.typical.value_or(0.75 * pixel), colors, to_working)
                       : path_surface(std::move(mesh), paths, colors, to_working);
  return shapes;
}

/// Refuses a scene so large that the renderer, whose precision is relative to its size, would lose the paths.
void require_fine(const Scene& scene, const RadiusDescription& radius, const SurfaceScene& stage,
                  const std::vector<Path>& paths) {
  const double typical = typical_radius(radius, paths.size(), scene.field.world_box());
  if (stage.bounds().diagonal().norm() < max_radii * typical) return;
  throw SceneError(fmt::format(
      "{}: paths are too thin ({:.3g}) for the size of the scene ({:.3g}); bring lamps, obstacles and plate nearer, or "
      "raise `/integrator/radius/typical`",
      scene.description.path.string(), typical, stage.bounds().diagonal().norm()));
}

/// Who renders a picture, and who hears of it.
struct StageRun {
  RenderJob* job;  ///< Null: this process alone, and nothing is kept.
  const Progress& progress;
  const RenderCallbacks& callbacks;
  std::vector<SurfaceLegend>& legends;  ///< Gets those of surfaces.
};

class LoadedPaths : public LoadedMethod {
 public:
  explicit LoadedPaths(PathScene paths) : paths_(std::move(paths)) {}

  Render render(const Scene& scene, const Progress& progress, RenderJob* job) const override;

 private:
  /// Renders the paths, their context and the lamps.
  SurfacePicture render_stage(const Scene& scene, const std::vector<Path>& paths, ShadedSurface path_surface,
                              const Camera& camera, const StageRun& run) const;

  PathScene paths_;
};

SurfacePicture LoadedPaths::render_stage(const Scene& scene, const std::vector<Path>& paths, ShadedSurface path_surface,
                                         const Camera& camera, const StageRun& run) const {
  const ShownLight& light = paths_.lights.light;
  std::vector<Material> materials{load_material(paths_.settings.material, light)};
  std::vector<ShadedSurface> surfaces{std::move(path_surface)};
  add_context(scene, paths_, run.job, run.progress, surfaces, materials, run.legends);
  const std::vector<Light> lights = make_lights(scene.description, paths_.lights, camera);
  add_lamps(lights, light, surfaces, materials);
  const SurfaceScene stage(std::move(surfaces));
  require_fine(scene, paths_.settings.radius, stage, paths);
  const LightSampler sampler(lights, light.luminances(), stage.bounds());
  const ReflectanceTable table(light.model, light.bands, light.xyz_to_working);
  ShadedScene shaded{stage, materials, sampler, table};
  set_groups(scene.description, shaded);
  return render_surfaces(shaded, camera, tracer_settings(scene.description, paths_.settings), run.callbacks);
}

/// @param turn  A rotation.
TubeMesh turned(TubeMesh tubes, const Eigen::Matrix3d& turn) {
  for (Eigen::Vector3d& vertex : tubes.mesh.vertices) vertex = turn * vertex;
  for (Eigen::Vector3f& normal : tubes.normals) normal = turn.cast<float>() * normal;
  return tubes;
}

/// Whether the file of paths has the tensors at their points.
bool stores_tensors(const OutputDescription& output) {
  return output.wants("paths") && tensorray::stores_tensors(output.files.at("paths"));
}

Render LoadedPaths::render(const Scene& scene, const Progress& progress, RenderJob* job) const {
  const PathTracingDescription& description = paths_.settings;
  const OutputDescription& output = scene.description.output;
  const bool has_picture = output.wants("image") || output.wants("exr") || output.wants("spectral");
  const bool is_drawn = has_picture || output.wants("tubes");
  const ShownLight& light = paths_.lights.light;
  const auto start = Clock::now();
  Render result;
  result.paths = follow_paths(scene, paths_, is_drawn || stores_tensors(output), job, progress, result.statistics);
  result.statistics.seconds_tracing = seconds_since(start);
  if (!is_drawn) return result;

  const auto drawing = Clock::now();
  const PathColors colors =
      path_colors(description.color, result.paths,
                  typical_radius(description.radius, result.paths.size(), scene.field.world_box()), units_of(scene));
  const bool has_legend = colors.legend || description.context.slice;
  // A legend that is asked for as an annotation is beside the picture: it has no effect on other files. So is that of a
  // picture whose camera is given.
  if (has_legend && (description.color.legend || output.default_annotations) && !scene.description.camera.position) {
    const Eigen::Vector2i& size = scene.description.camera.resolution;
    result.legend_room = std::min(legend_width(size.x(), size.y()), static_cast<int>(most_legend * size.x()));
  }
  const Camera camera =
      make_camera(scene.description, points_of_interest(scene, description.context, result.paths), result.legend_room);
  PathShapes shapes = make_shapes(scene, paths_, result.paths, colors, camera);
  result.exposure = 0;
  if (has_picture) result.view = picture_view(camera);
  const auto legends = std::make_shared<std::vector<SurfaceLegend>>();
  if (colors.legend) legends->push_back(colors.legend);
  if (has_legend && (description.color.legend || output.wants(Annotation::legend)))
    result.draw_legend = [legends, matrix = light.rec709_to_working](Image& image, double exposure) {
      for (std::size_t i = 0; i < legends->size(); ++i)
        (*legends)[i](image, std::exp2(exposure) * matrix, {i, legends->size()});
    };
  if (output.wants("tubes"))
    result.write_tubes = [tubes = turned(std::move(shapes.tubes), scene.description.turn().transpose()), colors](
                             const std::filesystem::path& file, const std::vector<Path>& paths) {
      write_tubes(file, tubes, paths, colors);
    };
  if (!has_picture) return result;
  if (description.context.body > 0 && !scene.geometry.has_cut())
    result.warnings.push_back("`/integrator/context/body` has no effect: the field has no surface (`/field/bounds`)");

  const auto add_picture = [&](const SurfacePicture& picture, Render& render) {
    set_picture(picture, light, description, scene.description, render);
  };
  const RenderCallbacks callbacks = render_callbacks(progress, job, result, add_picture);
  const StageRun run{job, progress, callbacks, *legends};
  add_picture(render_stage(scene, result.paths, std::move(shapes.surface), camera, run), result);
  result.statistics.seconds_drawing = seconds_since(drawing);
  return result;
}

void check_range(const std::optional<Eigen::Vector2d>& range, bool logarithmic, const char* pointer,
                 const SceneSource& source) {
  if (!range) return;
  if (!(range->x() < range->y()))
    source.fail(fmt::format("`{}` must rise, but is [{:g}, {:g}]", pointer, range->x(), range->y()));
  if (logarithmic && !(range->x() > 0))
    source.fail(fmt::format("`{}` is logarithmic and must be above 0, but begins at {:g}", pointer, range->x()));
}

void check_seeds(const SeedDescription& seeds, const SceneSource& source) {
  if (seeds.from && seeds.to && *seeds.from == *seeds.to && seeds.count > 1)
    source.fail("`/integrator/seeds`: `from` and `to` are equal, which allows only one seed; set `count` to 1");
  if (seeds.above && seeds.below && *seeds.above > *seeds.below)
    source.fail("`/integrator/seeds`: `above` must not exceed `below`");
}

void write_path_file(const std::filesystem::path& file, const Scene&, const Render& render) {
  write_paths(file, render.paths);
}

void write_tube_file(const std::filesystem::path& file, const Scene&, const Render& render) {
  render.write_tubes(file, render.paths);
}

class PathTracingMethod : public MethodWith<PathTracingDescription> {
 public:
  const char* name() const override { return "path_tracing"; }
  bool is_sampled() const override { return true; }

  std::vector<std::string> channels(const SceneDescription& scene) const override {
    return surface_channels(scene, false);
  }

  std::vector<Output> outputs() const override {
    return picture_outputs(
        {spectral_output(),
         {"paths", "the bent rays, with all quantities along them", {".vtp", ".tck"}, write_path_file},
         {"tubes", "the bent rays as a mesh", {".ply", ".obj"}, write_tube_file}});
  }

  std::vector<NamedFile> inputs() const override {
    return {{settings().paths, "`/integrator/paths`"}, {settings().seeds.file, "`/integrator/seeds/file`"}};
  }

  void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const override;

  std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const override {
    return std::make_unique<LoadedPaths>(load_paths(scene, settings(), notes));
  }
};

void PathTracingMethod::check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const {
  const PathTracingDescription& paths = settings();
  check_seeds(paths.seeds, source);
  check_range(paths.color.range, paths.color.logarithmic, "/integrator/color/range", source);
  if (paths.context.slice) check_range(paths.context.slice->range, false, "/integrator/context/slice/range", source);
  if (paths.radius.min && paths.radius.max && *paths.radius.min > *paths.radius.max)
    source.fail("`/integrator/radius`: `min` must not exceed `max`");
  if (!chosen) return;
  std::vector<Annotation> usual{Annotation::scale};
  if (paths.color.legend || !given(json, "/integrator/color/legend")) usual.push_back(Annotation::legend);
  default_annotations(scene, json, usual);
  if (scene.bending.settings.max_steps > 1'000'000)
    source.fail("`/bending/max_steps` must be at most 1e6 with path_tracing, which keeps every step of a path");
  check_memory(scene.camera.resolution.cast<double>().prod() *
                   (280.0 + (scene.output.wants("spectral") ? 24.0 * paths.bands : 0)),
               "`/camera/resolution`", source);
  warn_unused(scene, json, "/integrator/seeds", "/integrator/paths");
  if (given(json, "/integrator/samples"))  // Other programs and the lens use this name.
    scene.warnings.push_back("`/integrator/samples` has no effect with path_tracing; use `/integrator/max_samples`");
  if (scene.camera.target && !scene.camera.position)
    scene.warnings.push_back(
        "`/camera/target` has no effect without `/camera/position`: the camera is then chosen so that everything is "
        "seen");
}

}  // namespace

std::shared_ptr<Method> path_tracing_method() { return std::make_shared<PathTracingMethod>(); }

}  // namespace tensorray
