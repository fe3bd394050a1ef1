#include "tools/viewer/request_limits.h"

#include <fmt/format.h>

#include "base/text/text.h"
#include "scenes/description/check_scene.h"

namespace tensorray {
namespace {

constexpr double max_pixels = 2048.0 * 2048;
constexpr double max_positions = 1 << 22;
constexpr double max_generated_voxels = 256.0 * 256 * 256;
constexpr int max_bands = 512;
constexpr double max_ray_steps = 1 << 22;  // Of one ray, which cannot be interrupted.

std::filesystem::path resolved(const std::filesystem::path& file) {
  std::error_code none;
  const std::filesystem::path path = std::filesystem::weakly_canonical(std::filesystem::absolute(file), none);
  return none ? file : path;
}

void require_at_most(double limit, double value, const char* key, const SceneDescription& scene) {
  if (value > limit)
    throw SceneError(
        fmt::format("{}: `{}`: too large for a live view, which takes {:g} at most; use `tensorray render`",
                    printable(scene.path.string()), key, limit));
}

}  // namespace

AllowedFiles::AllowedFiles(const SceneDescription& scene) {
  for (const NamedFile& file : input_files(scene))
    if (!file.path.empty()) files_.insert(resolved(file.path));
}

void AllowedFiles::require(const SceneDescription& scene) const {
  for (const NamedFile& file : input_files(scene))
    if (!file.path.empty() && files_.count(resolved(file.path)) == 0)
      throw SceneError(printable(
          fmt::format("{}: {} is not a file of the scene that this view was started with; a page may use no other",
                      file.name, file.path.string())));
}

void require_moderate(const SceneDescription& scene) {
  if (scene.receiver.resolution)
    require_at_most(max_pixels, scene.receiver.resolution->cast<double>().prod(), "/receiver/resolution", scene);
  require_at_most(max_pixels, scene.camera.resolution.cast<double>().prod(), "/camera/resolution", scene);
  require_at_most(max_positions, static_cast<double>(scene.light.photons), "/light/photons", scene);
  require_at_most(max_bands, scene.light.wavelength_count, "/light/wavelengths/count", scene);
  require_at_most(max_ray_steps, scene.bending.settings.max_steps, "/bending/max_steps", scene);
  if (scene.field.generate)
    require_at_most(max_generated_voxels, scene.field.generate->grid.resolution.cast<double>().prod(),
                    "/field/generate/resolution", scene);
}

}  // namespace tensorray
