#include "integrators/scene/scene_method.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "base/process/progress.h"
#include "base/process/seconds.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "integrators/path_tracing/stage.h"
#include "integrators/scene/field_light.h"
#include "renderer/camera/path_tracer.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/picture_outputs.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr double tube_error = 0.2;  // Pixels: greatest distance of a tube's triangles from its surface.

/// What the method has loaded.
struct ObjectScene {
  SceneMethodDescription settings;
  PathTracingDescription tracing;
  ShownLights lights;
  std::vector<SceneObject> objects;
};

/// Whether the field bends light anywhere. Where it does not, the picture is that of the straight path tracer.
bool bends_light(const Scene& scene, const std::vector<Band>& bands) {
  const std::vector<Eigen::Vector3i>& bricks = scene.field.bricks();
  const auto flexibility = flexibility_of(scene.description.bending);
  const auto is_flexible = [&](const Band& band) { return flexibility(band.wavelength) != 0; };
  return std::any_of(bands.begin(), bands.end(), is_flexible) &&
         std::any_of(bricks.begin(), bricks.end(),
                     [&](const Eigen::Vector3i& brick) { return scene.field.brick(brick).strongest > 0; });
}

/// The points that an automatic camera shows: the volume, where straight light takes its corners on plates, and meshes.
std::vector<Vector3d> points_of_interest(const Scene& scene, const std::vector<SceneObject>& objects,
                                         const std::vector<Light>& lights) {
  std::vector<Vector3d> points = scene.field.corners();
  for (const SceneObject& object : objects) {
    if (!object.plate) points.insert(points.end(), object.mesh().vertices.begin(), object.mesh().vertices.end());
    for (const Light& each : lights) {
      if (!direction_at(each, Vector3d::Zero()) || !object.plate) continue;
      for (const Vector3d& corner : scene.field.corners()) {
        const Vector3d normal = object.plate->normal(), direction = *direction_at(each, corner);
        const double way = normal.dot(object.plate->center - corner) / normal.dot(direction);
        const Vector3d shadow = corner + way * direction;
        const Eigen::Vector2d across((shadow - object.plate->center).dot(object.plate->right),
                                     (shadow - object.plate->center).dot(object.plate->up));
        if (way > 0 && (across.cwiseAbs().array() < object.plate->size.array() / 2).all()) points.push_back(shadow);
      }
    }
  }
  return points;
}

/// The volume for rays that are seen. If surfaces reach into it and stop light there, all must.
Geometry seen_geometry(const Scene& scene, const SurfaceScene& stage) {
  Surfaces surfaces;
  surfaces.bounds = scene.geometry.surfaces().bounds;
  surfaces.cut = scene.geometry.surfaces().cut;
  const Eigen::AlignedBox3d volume = scene.field.world_box();
  const auto mesh_of = [](const ShadedSurface& surface) { return std::get<TriangleMesh>(surface.shape); };
  const std::vector<ShadedSurface>& all = stage.surfaces();
  const bool reach_in = std::any_of(all.begin(), all.end(), [&](const ShadedSurface& surface) {
    Eigen::AlignedBox3d box;
    for (const Vector3d& vertex : mesh_of(surface).vertices) box.extend(vertex);
    return box.intersects(volume);
  });
  if (reach_in) std::transform(all.begin(), all.end(), std::back_inserter(surfaces.obstacles), mesh_of);
  return Geometry(std::move(surfaces));
}

FieldViewSettings view_settings(const Scene& scene, const ObjectScene& loaded) {
  FieldViewSettings settings;
  settings.bending = scene.bending;
  settings.conserve = loaded.settings.conserve;
  settings.max_radiance_scale = loaded.settings.max_radiance_scale;
  settings.flexibility = [flexibility = flexibility_of(scene.description.bending), &bands = loaded.lights.light.bands](
                             int band, double place) {
    const Band& each = bands[static_cast<std::size_t>(band)];
    return flexibility(each.wavelength + (place - 0.5) * each.width);
  };
  return settings;
}

/// Light that surfaces have scattered is smooth, so that fewer bands do.
int bands_per_bounce(const SceneMethodDescription& settings) {
  return settings.bands_per_sample % 2 == 0 ? settings.bands_per_sample / 2 : settings.bands_per_sample;
}

/// The angle of a pixel, radians; of parallel rays, as seen over the distance at which they are sharp.
double pixel_angle(const Camera& camera) {
  return pixel_size(camera, camera.position + camera.focus_distance * camera.forward) / camera.focus_distance;
}

/// All bands must have as many samples. @param seconds  That have passed.
PathTracerSettings object_tracer_settings(const Scene& scene, const ObjectScene& loaded, const Camera& camera,
                                          double seconds) {
  PathTracerSettings settings = tracer_settings(scene.description, loaded.tracing);
  settings.transparent = loaded.tracing.background == Background::transparent;
  const int parts = loaded.tracing.bands / bands_per_bounce(loaded.settings);
  for (int* samples : {&settings.min_samples, &settings.max_samples, &settings.pass_samples})
    *samples = (*samples + parts - 1) / parts * parts;
  settings.first_samples = parts;
  settings.shading.pixel_angle = pixel_angle(camera);
  settings.max_seconds = std::max(0.0, settings.max_seconds - seconds);
  return settings;
}

void report(const FieldRegion& region, const ObjectScene& loaded, Render& result) {
  Statistics& statistics = result.statistics;
  statistics.ray_steps = region.steps();
  statistics.tensor_samples = region.tensor_samples();
  statistics.positions = region.ways();
  statistics.emitted = {region.ways()};
  statistics.ends.assign(1, EndCounts{});
  for (int end = 0; end < ray_end_count; ++end)
    statistics.ends[0][static_cast<std::size_t>(end)] = region.ways(static_cast<RayEnd>(end));
  if (region.limited() * 1000 > statistics.positions)
    result.warnings.push_back(
        fmt::format("the field increases radiance by more than `integrator.max_gain` ({:g}) on {:.2g}% of the ways "
                    "through it; the picture lacks this light",
                    loaded.settings.max_radiance_scale,
                    100.0 * static_cast<double>(region.limited()) / static_cast<double>(statistics.positions)));
}

void report(const std::vector<PhotonCounts>& passes, Render& result) {
  result.statistics.scene_method = SceneMethodStatistics();
  result.statistics.scene_method->photons = passes;
  std::uint64_t stopped = 0, emitted = 0;
  for (const PhotonCounts& counts : passes) {
    stopped += counts.ends[static_cast<std::size_t>(PhotonEnd::stopped)];
    emitted += counts.emitted;
  }
  if (stopped * 1000 > emitted)
    result.warnings.push_back(fmt::format("{:.1f}% of the photons could not be followed; the picture lacks their light",
                                          100.0 * static_cast<double>(stopped) / static_cast<double>(emitted)));
}

/// The light that falls through the field on objects, as it is found before the picture.
struct FieldLight {
  PhotonMaps photons;
  std::vector<IrradianceMap> maps;
};

class LoadedObjects : public LoadedMethod {
 public:
  explicit LoadedObjects(ObjectScene loaded) : loaded_(std::move(loaded)) {}

  Render render(const Scene& scene, const Progress& progress, RenderJob* job) const override;

 private:
  FieldLight trace_light(const LitObjects& lit, const FieldRegion& region, int passes, const Progress& progress) const;

  ObjectScene loaded_;
};

/// @param passes  Of photons.
FieldLight LoadedObjects::trace_light(const LitObjects& lit, const FieldRegion& region, int passes,
                                      const Progress& progress) const {
  const PhotonPairs pairs = photon_pairs(lit, loaded_.settings);
  return {trace_object_photons(lit, pairs, region, loaded_.settings.photons, passes, progress),
          land_light(lit, pairs, loaded_.lights.light, loaded_.settings.caustic, progress)};
}

Render LoadedObjects::render(const Scene& scene, const Progress& progress, RenderJob* job) const {
  const ShownLight& light = loaded_.lights.light;
  Clock::time_point start = Clock::now();
  Render result;
  const std::vector<Light> lights = scene_lights(scene, loaded_.lights, {});
  const Camera camera = make_camera(scene.description, points_of_interest(scene, loaded_.objects, lights), 0);
  std::vector<SceneObject> objects = loaded_.objects;
  make_tubes(scene, tube_error * pixel_size(camera, scene.field.world_box().center()), job, progress, objects);
  std::vector<ShadedSurface> surfaces;
  std::vector<Material> materials;
  add_objects(objects, light, surfaces, materials);
  add_lamps(lights, light, surfaces, materials);
  const SurfaceScene stage(std::move(surfaces));
  const LightSampler sampler(lights, light.luminances(), stage.bounds());
  const ReflectanceTable table(light.model, light.bands, light.xyz_to_working);
  const Geometry geometry = seen_geometry(scene, stage);
  const FieldRegion region(scene.field, geometry, view_settings(scene, loaded_));
  const bool bends = bends_light(scene, light.bands);
  ShadedScene shaded{stage, materials, sampler, table};
  if (bends) shaded.region = &region;
  set_groups(scene.description, shaded);
  shaded.bands_per_view = loaded_.settings.bands_per_sample;
  shaded.bands_per_bounce = bands_per_bounce(loaded_.settings);
  const PathTracerSettings samples = object_tracer_settings(scene, loaded_, camera, 0);
  FieldLight before;
  if (bends) {
    const LitObjects lit{scene, lights, objects, stage, job};
    before = trace_light(lit, region, samples.max_samples / samples.first_samples, progress);
    shaded.photons = &before.photons;
    shaded.irradiance_maps = std::move(before.maps);
  }
  report(before.photons.counts, result);
  result.statistics.seconds_tracing = seconds_since(start);

  start = Clock::now();
  result.exposure = 0;
  result.view = picture_view(camera);
  const auto add_picture = [&](const SurfacePicture& picture, Render& render) {
    set_picture(picture, light, loaded_.tracing, scene.description, render);
  };
  const RenderCallbacks callbacks = render_callbacks(progress, job, result, add_picture);
  const PathTracerSettings settings = object_tracer_settings(scene, loaded_, camera, result.statistics.seconds_tracing);
  const SurfacePicture picture = render_surfaces(shaded, camera, settings, callbacks);
  add_picture(picture, result);
  for (const PixelState& pixel : picture.pixels)
    result.statistics.scene_method->samples += static_cast<std::uint64_t>(pixel.samples);
  report(region, loaded_, result);
  result.statistics.seconds_drawing = seconds_since(start);
  return result;
}

class SceneMethod : public MethodWith<SceneMethodDescription> {
 public:
  const char* name() const override { return "scene"; }
  bool is_sampled() const override { return true; }

  /// The sun of a scene without `lights` shines along it, paths begin with it, and the automatic scale is for it.
  bool needs_light_direction(const SceneDescription& scene) const override {
    return scene.default_lights || !scene.field.scale ||
           std::any_of(scene.objects.begin(), scene.objects.end(),
                       [](const ObjectDescription& object) { return object.paths.has_value(); });
  }

  std::vector<std::string> channels(const SceneDescription& scene) const override {
    return surface_channels(scene, true);
  }

  std::optional<Vector3d> view_through(const SceneDescription& scene, const Vector3d& middle) const override {
    const CameraDescription& camera = scene.camera;
    if (!camera.position) return camera.direction.value_or(Framing().direction);
    return camera.target.value_or(middle) - *camera.position;
  }

  std::vector<Output> outputs() const override { return picture_outputs({spectral_output()}); }

  void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const override;
  void check_photons(const SceneDescription& scene, const PathTracingDescription& tracing,
                     const SceneSource& source) const;

  std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const override {
    const auto& tracing = scene.description.integrator.settings<PathTracingDescription>();
    ObjectScene loaded{settings(), tracing, load_lights(scene, tracing.bands, notes), {}};
    loaded.objects = load_objects(scene, tracing, loaded.lights, notes);
    return std::make_unique<LoadedObjects>(std::move(loaded));
  }
};

/// Photons of all passes are kept; most lights have none.
void SceneMethod::check_photons(const SceneDescription& scene, const PathTracingDescription& tracing,
                                const SceneSource& source) const {
  const bool wanted = std::any_of(scene.lights.begin(), scene.lights.end(), [&](const LightSourceDescription& light) {
    return light.caustic == LightCaustic::photons || light.kind == LightKind::area;
  });
  if (!wanted && settings().conserve == Conserve::power) return;
  const double passes = std::max(1, tracing.samples * bands_per_bounce(settings()) / tracing.bands);
  check_memory(passes * static_cast<double>(settings().photons.per_pass) * tracing.bands * sizeof(Photon),
               fmt::format("`/integrator/photons/per_pass`, with {:.0f} passes of {} bands,", passes, tracing.bands),
               source);
}

void SceneMethod::check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const {
  if (!chosen) return;
  const auto& tracing = scene.integrator.settings<PathTracingDescription>();
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].paths && tracing.style == PathStyle::lines)
      source.fail(
          fmt::format("`/objects/{}/paths` cannot have the `/integrator/style` \"lines\"; use \"tube\", "
                      "\"wire\" or \"ellipses\"",
                      i));
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    if (scene.lights[i].kind == LightKind::area && scene.lights[i].caustic == LightCaustic::map)
      source.fail(fmt::format("`/lights/{}/caustic` of an `area` cannot be \"map\"; use \"photons\" or \"auto\"", i));
  if (tracing.bands % settings().bands_per_sample != 0)
    source.fail(fmt::format("`/integrator/bands_per_sample` must divide `/integrator/bands` ({}), but is {}",
                            tracing.bands, settings().bands_per_sample));
  check_memory(scene.camera.resolution.cast<double>().prod() *
                   (540.0 + (scene.output.wants("spectral") ? 20.0 * tracing.bands : 0)),
               "`/camera/resolution`", source);
  check_photons(scene, tracing, source);
  const double picture = 1.0 * tracing.bands * settings().caustic.resolution * settings().caustic.resolution;
  check_memory(12 * picture, "`/integrator/caustic/resolution`", source);
  // Each light of these kinds may have a picture on each object; most cover a part of it.
  const auto lands = [](const LightSourceDescription& light) {
    return light.kind == LightKind::directional || light.kind == LightKind::point;
  };
  const auto landing = std::count_if(scene.lights.begin(), scene.lights.end(), lands);
  const double objects = static_cast<double>(std::max<std::size_t>(1, scene.objects.size()) + scene.obstacles.size());
  check_memory(static_cast<double>(landing) * objects * picture,
               fmt::format("the light of {} `/lights` through the field, on {:.0f} objects at "
                           "`/integrator/caustic/resolution` {},",
                           landing, objects, settings().caustic.resolution),
               source);
  if (given(json, "/integrator/conserve") && given(json, "/integrator/max_gain") &&
      settings().conserve == Conserve::radiance)
    scene.warnings.push_back("`/integrator/max_gain` has no effect where radiance is conserved");
  if (given(json, "/light/direction") && !needs_light_direction(scene))
    scene.warnings.push_back(
        "`/light/direction` has no effect on the picture: its light is that of `/lights`, there are no `paths`, and "
        "`/field/scale` is given");
}

}  // namespace

std::shared_ptr<Method> scene_method() { return std::make_shared<SceneMethod>(); }

}  // namespace tensorray
