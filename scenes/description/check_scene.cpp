#include "scenes/description/check_scene.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <set>
#include <string>

#include <fmt/core.h>

#include "base/process/process_limits.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "renderer/color/color.h"
#include "renderer/images/image.h"

namespace tensorray {
namespace {

void check_wavelengths(const LightDescription& light, const SceneSource& source) {
  const double min = light.wavelength_min, max = light.wavelength_max;
  if (min > max) source.fail(fmt::format("`/light/wavelengths/min` ({} nm) must not be above `max` ({} nm)", min, max));
  if (min == max && light.wavelength_count > 1)
    source.fail(fmt::format("`/light/wavelengths/count` must be 1, but is {}: `min` and `max` are the same wavelength",
                            light.wavelength_count));
  if (light.wavelengths_per_photon > 0 && light.wavelength_count % light.wavelengths_per_photon != 0)
    source.fail(fmt::format("`/light/wavelengths/per_photon` must divide `count` ({}), but is {}",
                            light.wavelength_count, light.wavelengths_per_photon));
}

/// s(λ) < 0 is allowed and bends light the other way. Usually it is a mistake: the range of wavelengths is too wide.
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

/// Whether a group's name can be that of a layer of the picture, and is not the name of another one.
bool is_layer(const std::string& name) {
  static const std::set<std::string> others{"normal", "albedo", "texture", "caustic", "straight"};
  const auto allowed = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  return !others.count(name) && std::all_of(name.begin(), name.end(), allowed);
}

void check_lights(const SceneDescription& scene, const SceneSource& source) {
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const LightSourceDescription& light = scene.lights[i];
    if (light.kind == LightKind::environment && light.file.empty())
      source.fail(fmt::format("`/lights/{}` is an environment and needs its `file`", i));
    if (light.kind == LightKind::area && !light.center)
      source.fail(fmt::format("`/lights/{}` is an area and needs its `center`", i));
    if (light.kind == LightKind::point && !light.position)
      source.fail(fmt::format("`/lights/{}` is a point and needs its `position`", i));
    if (!is_layer(light.group))
      source.fail(
          fmt::format("`/lights/{}/group` must consist of letters, digits, `_` and `-`, and not be the name of "
                      "another layer (normal, albedo, texture, caustic, straight)",
                      i));
  }
}

void check_objects(const SceneDescription& scene, const SceneSource& source) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const ObjectDescription& object = scene.objects[i];
    const auto* pattern = std::get_if<Pattern>(&object.texture);
    const bool is_mesh = !object.file.empty(), is_plain = pattern && *pattern == Pattern::none;
    if (!object.plate && !is_plain && (pattern || !is_mesh))
      source.fail(fmt::format("`/objects/{}/texture`: patterns are for plates, pictures for plates and meshes", i));
    if (!is_mesh && !(object.roughness_texture.empty() && object.normal_texture.empty()))
      source.fail(fmt::format("`/objects/{}`: only a mesh (`file`) has `roughness_texture` or `normal_texture`", i));
    if (!object.roughness_texture.empty() && object.material.kind == MaterialKind::diffuse)
      source.fail(fmt::format("`/objects/{}/roughness_texture`: `material.kind` \"diffuse\" has no roughness", i));
    if (!object.texture_layer.empty() && pattern)
      source.fail(fmt::format("`/objects/{}/texture_layer`: only pictures have layers; remove it", i));
    if (object.smooth_angle && object.file.empty())
      source.fail(fmt::format("`/objects/{}/smooth_angle`: only meshes (`file`) have smooth edges; remove it", i));
  }
}

void check_layers(SceneDescription& scene, const Json& json, const SceneSource& source) {
  const bool is_made = scene.output.wants("exr") || given(json, "/output/exr");
  for (const char* key : {"/output/exr_type", "/output/exr_layers"})
    if (!is_made && given(json, key))
      scene.warnings.push_back(fmt::format("`{}` has no effect without `/output/exr`", key));
  if (!scene.output.exr_layers) return;
  std::vector<std::string> known;
  for (const std::string& channel : scene.integrator.method().channels(scene))
    if (const std::string layer = layer_of(channel); !layer.empty() && (known.empty() || known.back() != layer))
      known.push_back(layer);
  for (const std::string& layer : *scene.output.exr_layers)
    if (std::find(known.begin(), known.end(), layer) == known.end())
      source.fail(fmt::format("`/output/exr_layers`: {} makes no layer \"{}\"; it makes {}",
                              scene.integrator.method().name(), layer,
                              known.empty() ? "none beside R, G, B and A; remove the key" : joined(known)));
}

/// Removes outputs that only another method can make, with a warning. @throw SceneError if no output is left.
void drop_unmade_outputs(SceneDescription& scene, const SceneSource& source) {
  const Method& method = scene.integrator.method();
  const std::vector<Output> made = method.outputs();
  std::map<std::string, std::filesystem::path> kept;
  std::string dropped;
  for (const auto& [key, file] : scene.output.files) {
    const bool is_made =
        std::any_of(made.begin(), made.end(), [&key = key](const Output& output) { return key == output.key; });
    if (is_made) {
      kept[key] = file;
    } else {
      dropped = key;
      scene.warnings.push_back(
          fmt::format("`/output/{0}` has no effect with {1}, which makes no {0}", key, method.name()));
    }
  }
  if (kept.empty() && !dropped.empty())
    source.fail(fmt::format("`/output/{0}` is the only output, and {1} makes no {0}; name an `image` or an `exr`",
                            dropped, method.name()));
  scene.output.files = std::move(kept);
}

}  // namespace

bool given(const Json& json, const char* pointer) { return json.contains(Json::json_pointer(pointer)); }

void default_annotations(SceneDescription& scene, const Json& json, std::vector<Annotation> annotations) {
  if (given(json, "/output/annotations")) return;
  scene.output.annotations = std::move(annotations);
  scene.output.default_annotations = true;
}

void warn_unused(SceneDescription& scene, const Json& json, const char* key, const char* because_of) {
  if (!given(json, key) || !given(json, because_of)) return;
  scene.warnings.push_back(fmt::format("`{}` has no effect beside `{}`", key, because_of));
}

void check_normal(const std::optional<Eigen::Vector3d>& normal, const char* pointer, const LightDescription& light,
                  const SceneSource& source) {
  if (!normal || !light.direction) return;
  if (std::abs(normal->normalized().dot(light.direction->normalized())) > 1e-6) return;
  source.fail(
      fmt::format("`{}/normal` is perpendicular to the light, so that the plane is seen edge-on; turn it "
                  "towards the light",
                  pointer));
}

void check_memory(double bytes, const std::string& what, const SceneSource& source) {
  constexpr double program = 60e6;  // What the smallest render takes.
  const MemoryLimit limit = memory_limit();
  if (bytes + program > limit.bytes)
    source.fail(fmt::format("{} needs about {}, more than {}, {}; ask for less of it", what,
                            bytes_text(bytes + program), limit.cause, bytes_text(limit.bytes)));
}

void check_receiver_memory(const SceneDescription& scene, double bytes_per_pixel, const SceneSource& source) {
  if (!scene.receiver.resolution) return;
  check_memory(scene.receiver.resolution->cast<double>().prod() * bytes_per_pixel, "`/receiver/resolution`", source);
}

int channel_count(const SceneDescription& scene) { return scene.bending.rgb ? 3 : scene.light.wavelength_count; }

void check_spectral_output(const SceneDescription& scene, const SceneSource& source) {
  if (scene.bending.rgb && scene.output.wants("spectral"))
    source.fail("`/output/spectral` needs wavelengths, but `/bending/rgb` has none; remove one of the two");
}

void check_scene(SceneDescription& scene, const Json& json, const SceneSource& source) {
  scene.default_lights = !given(json, "/lights");
  scene.default_objects = !given(json, "/objects");
  std::string& ocio = scene.output.ocio;
  if (!ocio.empty() && !is_library_config(ocio)) ocio = source.resolve(path_of_text(ocio)).string();
  if (!scene.bending.rgb) check_wavelengths(scene.light, source);
  check_normal(scene.receiver.normal, "/receiver", scene.light, source);
  check_lights(scene, source);
  check_objects(scene, source);
  drop_unmade_outputs(scene, source);
  check_layers(scene, json, source);
  for (const auto& method : scene.integrator.methods)
    method->check(scene, json, source, method.get() == &scene.integrator.method());
  check_files(scene);
  warn_of_negative_flexibility(scene);
  warn_unused(scene, json, "/field/name", "/field/generate");
  warn_unused(scene, json, "/field/derive", "/field/generate");
  warn_unused(scene, json, "/bending/a", "/bending/rgb");
  warn_unused(scene, json, "/bending/b", "/bending/rgb");
  warn_unused(scene, json, "/light/wavelengths", "/bending/rgb");
}

std::string Output::ending_of(const std::filesystem::path& file) const {
  for (const std::string& ending : option_endings())
    if (ends_with(file.string(), ending)) return ending;
  return "";
}

const Method& IntegratorDescription::method() const {
  for (const auto& method : methods)
    if (method->name() == type.value) return *method;
  throw std::logic_error("no method is chosen");
}

std::vector<NamedFile> input_files(const SceneDescription& scene) {
  std::vector<NamedFile> files;
  if (!is_device(scene.path)) files.push_back({scene.path, "the scene file"});  // A scene may come through a pipe.
  files.push_back({scene.field.file_to_read(), "`/field/file`"});
  if (const auto* bounds = std::get_if<std::filesystem::path>(&scene.field.bounds))
    files.push_back({*bounds, "`/field/bounds`"});
  const char* const environment = std::getenv("OCIO");  // It counts only where the scene names no config.
  const bool is_own = !scene.output.ocio.empty();
  const std::string config = is_own ? scene.output.ocio : environment ? environment : "";
  if (!is_library_config(config)) files.push_back({config, is_own ? "`/output/ocio`" : "$OCIO"});
  if (const auto* spectrum = std::get_if<std::filesystem::path>(&scene.light.spectrum))
    files.push_back({*spectrum, "`/light/spectrum`"});
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    files.push_back({scene.obstacles[i], fmt::format("`/obstacles/{}/file`", i)});
  for (std::size_t i = 0; i < scene.lights.size(); ++i)
    files.push_back({scene.lights[i].file, fmt::format("`/lights/{}/file`", i)});
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    files.push_back({scene.objects[i].file, fmt::format("`/objects/{}/file`", i)});
    if (const auto* picture = std::get_if<std::filesystem::path>(&scene.objects[i].texture))
      files.push_back({*picture, fmt::format("`/objects/{}/texture`", i)});
    files.push_back({scene.objects[i].roughness_texture, fmt::format("`/objects/{}/roughness_texture`", i)});
    files.push_back({scene.objects[i].normal_texture, fmt::format("`/objects/{}/normal_texture`", i)});
  }
  for (const auto& method : scene.integrator.methods)
    for (NamedFile& file : method->inputs()) files.push_back(std::move(file));
  return files;
}

void check_files(const SceneDescription& scene, const std::vector<NamedFile>& more,
                 const std::vector<NamedFile>& read) {
  std::vector<NamedFile> outputs;
  for (const auto& [key, file] : scene.output.files) outputs.push_back({file, "`/output/" + key + "`"});
  outputs.insert(outputs.end(), more.begin(), more.end());
  try {
    std::vector<NamedFile> inputs = input_files(scene);
    inputs.insert(inputs.end(), read.begin(), read.end());
    require_distinct_files(inputs, outputs);
  } catch (const std::invalid_argument& error) {
    throw SceneError(printable(scene.path.string() + ": " + error.what()));
  }
}

}  // namespace tensorray
