#include "integrators/stretch/stretch_method.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/process/progress.h"
#include "base/process/seconds.h"
#include "integrators/stretch/stretch.h"
#include "renderer/charts/color_bar.h"
#include "renderer/charts/colormap.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/channel_table.h"
#include "scenes/outputs/picture_outputs.h"

namespace tensorray {
namespace {

constexpr double default_wavelength = 550;  // nm
constexpr Colormap map = Colormap::cool_warm;

/// Settings for light of one flexibility along the beam. @throw SceneError if its length is 0.
StretchSettings settings_of(const Scene& scene, const StretchDescription& description) {
  const BendingDescription& bending = scene.description.bending;
  const DepthRange depths = depth_range(scene.field, scene.beam.center, scene.beam.direction);
  StretchSettings settings;
  settings.direction = scene.beam.direction;
  settings.flexibility =
      bending.rgb ? bending.rgb->y() : bending.flexibility.at(description.wavelength.value_or(default_wavelength));
  settings.length = description.length.value_or(depths.far - depths.near);
  if (!(settings.length > 0))
    throw SceneError(scene.description.path.string() +
                     ": `/integrator/stretch/length` is needed: the volume has no depth along the light");
  return settings;
}

ImageMetadata metadata_of(const StretchSettings& settings, const SceneDescription& scene) {
  const Eigen::Vector3d direction = scene.turn().transpose() * settings.direction;  // In the axes of its file.
  return {{"tensorray:units", "1/length"},
          {"tensorray:length", fmt::format("{}", settings.length)},
          {"tensorray:flexibility", fmt::format("{}", settings.flexibility)},
          {"tensorray:direction", fmt::format("{} {} {}", direction.x(), direction.y(), direction.z())}};
}

/// What is known of a pixel whose ray has a value.
struct StretchPixel {
  Eigen::Vector3f color;
  float stretch;
};

ChannelTable<StretchPixel> stretch_channels() {
  using Pixel = const StretchPixel&;
  return {{{"R", "G", "B"}, [](Pixel pixel) { return pixel.color; }},
          {{"A"}, [](Pixel) { return 1; }},
          {{"stretch"}, [](Pixel pixel) { return pixel.stretch; }}};
}

/// Makes the pictures from the values at the pixels of the entry plane, which is seen along the light as the plate is.
void draw(const Scene& scene, const std::vector<float>& values, const Eigen::Vector2i& resolution, Render& render) {
  RangeChoice choice;
  choice.symmetric = true;  // 0 has the middle of the colours.
  const ValueRange range = choose_range({values.begin(), values.end()}, choice);
  const Eigen::Matrix3d to_working = scene.color.xyz_to_working() * rec709_to_xyz();
  const ChannelTable<StretchPixel> table = stretch_channels();
  Image linear(resolution.x(), resolution.y(), channel_names(table));
  Image display(resolution.x(), resolution.y(), {"R", "G", "B", "A"});
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    const double position = range.position(values[i]);
    write_channels(table, {(to_working * colormap_linear(map, position)).cast<float>(), values[i]},
                   &linear.pixels[i * linear.channels.size()]);
    Eigen::Map<Eigen::Vector4f>(&display.pixels[4 * i]) = colormap_srgb(map, position).cast<float>().homogeneous();
  }
  if (scene.description.output.wants(Annotation::legend)) {
    const std::string length = units_of(scene).length;
    const ColorBar bar{"stretch\n1/" + (length.empty() ? "length" : length), range,
                       [](double position) { return colormap_srgb(map, position); }};
    render.draw_legend = [bar](Image& image, double) { draw_color_bar(image, bar); };
  }
  render.linear = std::move(linear);
  render.display = std::move(display);
}

class LoadedStretch : public LoadedMethod {
 public:
  LoadedStretch(const StretchDescription& description, const StretchSettings& settings)
      : description_(description), settings_(settings) {}

  Render render(const Scene& scene, const Progress& progress, RenderJob* job) const override {
    const auto start = Clock::now();
    StretchSettings settings = settings_;
    settings.job = job;
    const OutputDescription& output = scene.description.output;
    Surfaces surfaces = scene.geometry.surfaces();
    surfaces.plate.reset();  // Rays would end on it.
    const Geometry geometry(std::move(surfaces));
    Render result;
    result.metadata = metadata_of(settings_, scene.description);
    if (output.wants("stretch")) {
      result.grids.push_back(
          stretch_grid(scene.field, geometry, scene.bending, settings, description_.resolution, progress));
      const ImageMetadata metadata = provenance(scene, result);
      result.grids.back().metadata.insert(metadata.begin(), metadata.end());
    }
    if (output.wants("image") || output.wants("exr")) {
      const DepthRange depths = depth_range(scene.field, scene.beam.center, scene.beam.direction);
      const Plate plane = plate_across(scene.beam, depths.near, description_.pixels);
      if (job)
        settings.show = [&](const std::vector<float>& picture) {
          if (!job->takes_picture_request()) return;
          Render so_far = result;
          draw(scene, picture, plane.resolution, so_far);
          job->show(std::move(so_far));
        };
      draw(scene, stretch_picture(scene.field, geometry, scene.bending, settings, plane, progress), plane.resolution,
           result);
      result.view = picture_view(plane);
    }
    result.statistics.seconds_tracing = seconds_since(start);
    return result;
  }

 private:
  StretchDescription description_;
  StretchSettings settings_;
};

class StretchMethod : public MethodWith<StretchKeys> {
 public:
  const char* name() const override { return "stretch"; }

  std::vector<std::string> channels(const SceneDescription&) const override {
    return channel_names(stretch_channels());
  }

  std::vector<Output> outputs() const override {
    return picture_outputs({{"stretch", "the stretch in the volume, as a float grid", {".vdb"}, write_grids}});
  }

  void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const override {
    if (chosen) default_annotations(scene, json, {Annotation::legend});
    if (chosen && scene.bending.rgb && settings().stretch.wavelength)
      source.fail(
          "`/integrator/stretch/wavelength`: light has no wavelength where `/bending/rgb` is given; remove one "
          "of the two");
  }

  std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const override {
    const StretchSettings chosen = settings_of(scene, settings().stretch);
    notes.push_back(
        fmt::format("stretch: of light with s = {:.4g}, over a length of {:.6g}", chosen.flexibility, chosen.length));
    return std::make_unique<LoadedStretch>(settings().stretch, chosen);
  }
};

}  // namespace

std::shared_ptr<Method> stretch_method() { return std::make_shared<StretchMethod>(); }

}  // namespace tensorray
