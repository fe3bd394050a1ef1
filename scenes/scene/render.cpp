#include "scenes/scene/render.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "scenes/scene/scene.h"
#include "scenes/scene/turning.h"

namespace tensorray {
namespace {

void warn_of_step_limit(Render& render) {
  std::uint64_t emitted = 0, limited = 0;
  for (const std::uint64_t count : render.statistics.emitted) emitted += count;
  for (const EndCounts& counts : render.statistics.ends) limited += counts[static_cast<int>(RayEnd::step_limit)];
  if (100 * limited > emitted)
    render.warnings.push_back(fmt::format("{:.0f}% of the rays were given up after `bending.max_steps` steps; raise it",
                                          100.0 * static_cast<double>(limited) / static_cast<double>(emitted)));
}

/// Where an annotation has no meaning for a picture.
void warn_of_annotations(const Scene& scene, Render& render) {
  const OutputDescription& output = scene.description.output;
  if (!render.view) return;
  if (output.wants(Annotation::scale) && render.view->is_perspective)
    render.notes.push_back(
        "the scale bar is right where the camera is focused, by default the middle of what it shows, as the camera is "
        "in perspective");
  if (output.default_annotations) return;
  if ((output.wants(Annotation::body) || output.wants(Annotation::hidden)) && render.outline.empty())
    render.warnings.push_back(
        "`/output/annotations`: there are no lines of a body: light on a plate and a lens have them, where the field "
        "has a surface (`/field/bounds`) or there are `/obstacles`");
  if (output.wants(Annotation::legend) && !render.draw_legend)
    render.warnings.push_back(
        fmt::format("`/output/annotations`: this picture of {} has no colours with a meaning, and gets no legend",
                    scene.description.integrator.method().name()));
}

}  // namespace

Strength LoadedMethod::strength(const Scene& scene) const { return {"field", "scale", scene.scale.scale}; }

bool nothing_arrived(const Statistics& statistics) {
  return std::all_of(statistics.ends.begin(), statistics.ends.end(),
                     [](const EndCounts& counts) { return counts[static_cast<int>(RayEnd::plate)] == 0; });
}

void gather_counts(Ranks* ranks, Statistics& statistics) {
  gather_in_turn(ranks, [&](Archive& archive) {
    archive.copy_sums(&statistics.ray_steps, 1);
    archive.copy_sums(&statistics.tensor_samples, 1);
  });
}

Render render(const Scene& scene, const Progress& progress, RenderJob* job) {
  const bool is_turned = scene.description.world.up == UpAxis::y;
  const Eigen::Matrix3d back = scene.description.turn().transpose();
  if (is_turned && job && job->show)
    job->show = [show = job->show, back](Render so_far) { show(turned(std::move(so_far), back)); };
  Render result = scene.method->render(scene, progress, job);
  if (is_turned) result = turned(std::move(result), back);
  warn_of_step_limit(result);
  warn_of_annotations(scene, result);
  return result;
}

LightRange light_range(const Scene& scene) {
  const BendingDescription& bending = scene.description.bending;
  const LightDescription& light = scene.description.light;
  if (bending.rgb) return {{bending.rgb->x(), bending.rgb->y(), bending.rgb->z()}, false};
  return {{bending.flexibility.at(light.wavelength_min), bending.flexibility.at(light.wavelength_max)}, true};
}

std::size_t reference_channel(const Scene& scene) {
  if (scene.description.bending.rgb) return 1;
  constexpr double wavelength = 550;
  const auto nearest = std::min_element(scene.bands.begin(), scene.bands.end(), [](const Band& a, const Band& b) {
    return std::abs(a.wavelength - wavelength) < std::abs(b.wavelength - wavelength);
  });
  return static_cast<std::size_t>(nearest - scene.bands.begin());
}

double reference_place(const Scene& scene) {
  const auto channel = static_cast<double>(reference_channel(scene));
  return scene.description.bending.rgb ? channel / 2 : (channel + 0.5) / static_cast<double>(scene.bands.size());
}

std::vector<FineBand> fine_bands(const Scene& scene, int count) {
  std::vector<FineBand> bands;
  if (scene.description.bending.rgb) {
    const double last = static_cast<double>(scene.bands.size() - 1);
    for (std::size_t k = 0; k < scene.bands.size(); ++k) {
      const double place = static_cast<double>(k) / last;
      bands.push_back({scene.bands[k], place, place, k, 1});
    }
    return bands;
  }
  const LightDescription& light = scene.description.light;
  const std::vector<Band> fine = make_bands(scene.spectrum, light.wavelength_min, light.wavelength_max, count);
  const std::size_t parts = fine.size() / scene.bands.size();
  for (std::size_t i = 0; i < fine.size(); ++i) {
    const std::size_t channel = i / parts;
    const double power = scene.bands[channel].power;
    bands.push_back({fine[i], static_cast<double>(i) / count, static_cast<double>(i + 1) / count, channel,
                     power > 0 ? fine[i].power / power : 0});
  }
  return bands;
}

}  // namespace tensorray
