#include "scenes/check_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "renderer/color/spectrum.h"
#include "scenes/choices.h"

namespace tensorray {
namespace {

bool given(const Json& json, const char* pointer) { return json.contains(Json::json_pointer(pointer)); }

void warn_unused(SceneDescription& scene, const Json& json, const char* key, const char* because_of) {
  if (!given(json, key) || !given(json, because_of)) return;
  scene.warnings.push_back(fmt::format("`{}` has no effect beside `{}`", key, because_of));
}

void check_wavelengths(const LightDescription& light, const SceneSource& source) {
  const double min = light.wavelength_min, max = light.wavelength_max;
  if (min > max) {
    source.fail(fmt::format("`/light/wavelengths/min` ({} nm) must not be above `max` ({} nm)", min, max));
  }
  if (min == max && light.wavelength_count > 1) {
    source.fail(fmt::format("`/light/wavelengths/count` must be 1, but is {}: `min` and `max` are the same wavelength",
                            light.wavelength_count));
  }
  if (light.wavelengths_per_photon > 0 && light.wavelength_count % light.wavelengths_per_photon != 0) {
    source.fail(fmt::format("`/light/wavelengths/per_photon` must divide `count` ({}), but is {}",
                            light.wavelength_count, light.wavelengths_per_photon));
  }
}

/// An illuminant, "blackbody KELVIN", or a file; files come out relative to where the scene's are.
void check_spectrum(LightDescription& light, const SceneSource& source) {
  const std::vector<std::string> names = illuminant_names();
  const std::string& text = light.spectrum;
  if (std::find(names.begin(), names.end(), text) != names.end()) return;

  const std::string blackbody = "blackbody";
  if (text == blackbody || text.compare(0, blackbody.size() + 1, blackbody + " ") == 0) {
    double kelvin = 0;
    char rest = 0;
    const bool read = std::sscanf(text.c_str() + blackbody.size(), " %lf %c", &kelvin, &rest) == 1;
    if (read && kelvin >= 100 && kelvin <= 1e9) return;
    source.fail(fmt::format(
        "`/light/spectrum` must be \"blackbody KELVIN\" with a temperature from 100 to 1e9, but is \"{}\"", text));
  }
  if (text.find_first_of("./") == std::string::npos) {
    std::string known;
    for (const std::string& name : names) known += fmt::format("\"{}\", ", name);
    source.fail(fmt::format(
        "`/light/spectrum` must be one of {}\"blackbody KELVIN\", or a file (NAME.txt), but is \"{}\"", known, text));
  }
  light.spectrum = source.resolve(text).string();
}

/// A built-in image, or a file; files come out relative to where the scene's are.
void check_image(LensDescription& lens, const SceneSource& source) {
  std::string known;
  for (const auto& choice : choices(TestImage())) {
    if (lens.image == choice.name) return;
    known += fmt::format("\"{}\", ", choice.name);
  }
  if (lens.image.find_first_of("./") == std::string::npos)
    source.fail(
        fmt::format("`/integrator/image` must be one of {}or a file (NAME.png), but is \"{}\"", known, lens.image));
  lens.image = source.resolve(lens.image).string();
}

/// s(λ) < 0 is allowed, and bends light the other way: more often than not the range was widened carelessly.
void warn_of_negative_flexibility(SceneDescription& scene) {
  if (scene.bending.rgb) {
    if (scene.bending.rgb->minCoeff() < 0)
      scene.warnings.push_back("`/bending/rgb`: where the flexibility is negative, light bends the other way");
    return;
  }
  const double at_min = scene.bending.flexibility.at(scene.light.wavelength_min);
  const double at_max = scene.bending.flexibility.at(scene.light.wavelength_max);
  if (at_min >= 0 && at_max >= 0) return;
  scene.warnings.push_back(
      fmt::format("`/bending`: s = a + b * wavelength is {:.4g} at {} nm and {:.4g} at {} nm; where it is negative, "
                  "light bends the other way",
                  at_min, scene.light.wavelength_min, at_max, scene.light.wavelength_max));
}

void check_normal(const std::optional<Eigen::Vector3d>& normal, const char* pointer, const LightDescription& light,
                  const SceneSource& source) {
  if (!normal || std::abs(normal->normalized().dot(light.direction.normalized())) > 1e-6) return;
  source.fail(
      fmt::format("`{}/normal` is across the light: it would be seen edge-on; turn it towards the light", pointer));
}

/// A file where an earlier step may have left another form of the same path.
std::filesystem::path identity(const std::filesystem::path& path) {
  return std::filesystem::absolute(path).lexically_normal();
}

std::map<std::filesystem::path, std::string> input_files(const SceneDescription& scene) {
  std::map<std::filesystem::path, std::string> files;
  const auto add = [&files](const std::filesystem::path& path, const std::string& what) {
    if (!path.empty()) files.emplace(identity(path), what);
  };
  add(scene.path, "the scene file");
  add(scene.field.file, "`/field/file`");
  add(scene.field.bounds, "`/field/bounds`");
  add(scene.output.ocio, "`/output/ocio`");
  for (const auto& obstacle : scene.obstacles) add(obstacle, "an obstacle's file");
  add(scene.integrator.lens.image, "`/integrator/image`");
  add(scene.integrator.paths.paths, "`/integrator/paths`");
  add(scene.integrator.paths.seeds.file, "`/integrator/seeds/file`");
  for (const LightSourceDescription& light : scene.lights) add(light.file, "a light's file");
  return files;
}

/// Outputs that belong to another method are left out, unless nothing is left to write.
void drop_unmade_outputs(SceneDescription& scene, const SceneSource& source) {
  OutputDescription& output = scene.output;
  const auto drop = [&](std::filesystem::path& path, const char* name, const char* what, IntegratorType maker) {
    if (path.empty() || scene.integrator.type == maker) return;
    path.clear();
    const char* type = choice_name(scene.integrator.type);
    scene.warnings.push_back(fmt::format("`/output/{}` has no effect with {}, which makes no {}", name, type, what));
    if (output.image.empty() && output.exr.empty() && output.spectral.empty() && output.photons.empty() &&
        output.paths.empty() && output.tubes.empty() && output.fluence.empty())
      source.fail(fmt::format("`/output/{}` is the only output, and {} makes no {}; name an `image` or an `exr`", name,
                              type, what));
  };
  drop(output.photons, "photons", "photons", IntegratorType::photon_distribution);
  drop(output.fluence, "fluence", "fluence", IntegratorType::photon_distribution);
  drop(output.paths, "paths", "paths", IntegratorType::path_tracing);
  drop(output.tubes, "tubes", "tubes", IntegratorType::path_tracing);
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
    source.fail(
        "`/integrator/seeds`: `from` and `to` are one point, where there is room for one seed; set `count` to 1");
  if (seeds.above && seeds.below && *seeds.above > *seeds.below)
    source.fail("`/integrator/seeds`: `above` must not exceed `below`");
}

void check_path_tracing(const SceneDescription& scene, const SceneSource& source) {
  const PathTracingDescription& paths = scene.integrator.paths;
  check_seeds(paths.seeds, source);
  if (scene.integrator.type == IntegratorType::path_tracing && scene.bending.settings.max_steps > 1'000'000)
    source.fail("`/bending/max_steps` must be at most 1e6 with path_tracing, which keeps every step of a path");
  check_range(paths.color.range, paths.color.logarithmic, "/integrator/color/range", source);
  if (paths.context.slice) check_range(paths.context.slice->range, false, "/integrator/context/slice/range", source);
  if (paths.radius.min && paths.radius.max && *paths.radius.min > *paths.radius.max)
    source.fail("`/integrator/radius`: `min` must not exceed `max`");
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    if (scene.lights[i].kind == LightKind::environment && scene.lights[i].file.empty())
      source.fail(fmt::format("`/lights/{}` is an environment and needs its `file`", i));
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    if (scene.lights[i].kind == LightKind::area && !scene.lights[i].center)
      source.fail(fmt::format("`/lights/{}` is an area and needs its `center`", i));
}

/// The names of other programs, and of another method, for what one wants here.
void warn_of_other_samples(SceneDescription& scene, const Json& json) {
  if (json["integrator"].contains("samples"))
    scene.warnings.push_back(
        "`/integrator/samples` is the lens's and has no effect with path_tracing; `max_samples` has");
  if (scene.camera.target && !scene.camera.position)
    scene.warnings.push_back(
        "`/camera/target` has no effect without `/camera/position`: the camera is then chosen so that everything is "
        "seen");
}

void check_output(SceneDescription& scene, const SceneSource& source) {
  OutputDescription& output = scene.output;
  drop_unmade_outputs(scene, source);
  std::map<std::filesystem::path, std::string> taken = input_files(scene);
  const auto check = [&](const std::filesystem::path& path, const std::string& pointer) {
    // Devices may take several files, one after the other.
    if (path.empty() || path.parent_path() == "/dev") return;
    const auto [other, is_new] = taken.emplace(identity(path), "`" + pointer + "`");
    if (is_new) return;
    source.fail(fmt::format("`{}` ({}) is the same file as {}; choose another", pointer, path.string(), other->second));
  };
  check(output.image, "/output/image");
  check(output.exr, "/output/exr");
  check(output.spectral, "/output/spectral");
  check(output.photons, "/output/photons");
  check(output.paths, "/output/paths");
  check(output.tubes, "/output/tubes");
  check(output.fluence, "/output/fluence");
  if (output.fluence_bands && output.fluence.empty() && scene.integrator.type == IntegratorType::photon_distribution)
    scene.warnings.push_back("`/output/fluence_bands` has no effect without `/output/fluence`");
  if (scene.bending.rgb && !output.spectral.empty() && scene.integrator.type != IntegratorType::path_tracing) {
    source.fail("`/output/spectral` needs wavelengths, which `/bending/rgb` has none of; remove one of the two");
  }
}

constexpr double most_gibibytes = 64;

/// The picture in memory, in double precision.
void check_memory(const SceneDescription& scene, const SceneSource& source) {
  if (scene.integrator.type == IntegratorType::path_tracing) {
    const double bytes = scene.camera.resolution.cast<double>().prod() * (200.0 + 24.0 * scene.integrator.paths.bands);
    if (bytes > most_gibibytes * (1 << 30))
      source.fail(fmt::format("`/camera/resolution` needs {:.0f} GiB; ask for fewer pixels", bytes / (1 << 30)));
  }
  if (!scene.receiver.resolution) return;
  const int channels = scene.bending.rgb ? 3 : scene.light.wavelength_count;
  const double pixels = scene.receiver.resolution->cast<double>().prod();
  double bytes = pixels * channels * sizeof(double);
  if (scene.integrator.type == IntegratorType::lens) {
    // Rays, their mesh, and two copies of the picture with all of its channels, for each depth.
    const auto& depth = scene.integrator.lens.plane.depth;
    bytes += pixels * (600 + 2.0 * sizeof(float) * (15 + channels) * static_cast<double>(depth ? depth->size() : 1));
  }
  const double gibibytes = bytes / (1 << 30);
  if (gibibytes <= most_gibibytes) return;
  source.fail(
      fmt::format("`/receiver/resolution` with {} channels of light needs {:.0f} GiB; ask for fewer pixels or a "
                  "lower `/light/wavelengths/count`",
                  channels, gibibytes));
}

}  // namespace

void check_scene(SceneDescription& scene, const Json& json, const SceneSource& source) {
  if (!scene.bending.rgb) check_wavelengths(scene.light, source);
  check_spectrum(scene.light, source);
  check_image(scene.integrator.lens, source);
  check_normal(scene.receiver.normal, "/receiver", scene.light, source);
  check_normal(scene.integrator.lens.plane.normal, "/integrator/image_plane", scene.light, source);
  check_path_tracing(scene, source);
  check_memory(scene, source);
  check_output(scene, source);
  warn_of_negative_flexibility(scene);
  warn_unused(scene, json, "/field/name", "/field/generate");
  warn_unused(scene, json, "/field/derive", "/field/generate");
  warn_unused(scene, json, "/bending/a", "/bending/rgb");
  warn_unused(scene, json, "/bending/b", "/bending/rgb");
  warn_unused(scene, json, "/light/wavelengths", "/bending/rgb");
  if (scene.integrator.type == IntegratorType::path_tracing) {
    warn_unused(scene, json, "/integrator/seeds", "/integrator/paths");
    warn_of_other_samples(scene, json);
  } else {
    warn_unused(scene, json, "/light/spectrum", "/bending/rgb");
  }
}

}  // namespace tensorray
