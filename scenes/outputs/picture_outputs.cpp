#include "scenes/outputs/picture_outputs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/text/path_text.h"
#include "renderer/charts/annotations.h"
#include "renderer/charts/color_bar.h"
#include "renderer/color/color.h"
#include "renderer/spectra/spectrum.h"
#include "volumes/files/tensor_files.h"
#include "volumes/files/voxel_images.h"

namespace tensorray {
namespace {

constexpr std::array<float, 3> hatch_line{0.42f, 0.5f, 0.66f}, hatch_ground{0.24f, 0.3f, 0.42f};  // Linear Rec. 709.

/// Marks a file with the display that its colours are for; with nothing if that is not known.
void add_display(const Scene& scene, const Render& render, ImageMetadata& metadata) {
  const DisplayEncoding& encoding = scene.color.display_encoding();
  if (render.display || encoding.is_srgb) return;  // Files are sRGB unless they say otherwise.
  metadata["oiio:ColorSpace"] = "";
  if (!encoding.icc_profile.empty()) metadata["ICCProfile"] = encoding.icc_profile;
}

void write_display(const std::filesystem::path& file, const Scene& scene, const Render& render) {
  ImageMetadata metadata = provenance(scene, render);
  add_display(scene, render, metadata);
  if (!render.display) metadata["tensorray:exposure"] = fmt::format("{:.4g}", display_exposure(scene, render));
  write_image(file, display_image(scene, render, holds_alpha(file)), metadata);
}

/// The picture as its EXR has it.
Image exr_of(const Image& linear, const OutputDescription& output) {
  std::vector<std::size_t> kept;
  std::vector<std::string> names;
  for (std::size_t c = 0; c < linear.channels.size(); ++c) {
    const std::string layer = layer_of(linear.channels[c]);
    const auto is_layer = [&](const std::string& wanted) { return wanted == layer; };
    if (output.exr_layers && !layer.empty() &&
        std::none_of(output.exr_layers->begin(), output.exr_layers->end(), is_layer))
      continue;
    kept.push_back(c);
    names.push_back(linear.channels[c]);
  }
  Image image(linear.width, linear.height, names);
  image.has_half_colors = output.exr_type == ExrType::half;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = linear.pixels[i / kept.size() * linear.channels.size() + kept[i % kept.size()]];
  return image;
}

void write_linear(const std::filesystem::path& file, const Scene& scene, const Render& render) {
  ImageMetadata metadata = provenance(scene, render);
  metadata["chromaticities"] = fmt::format("{}", fmt::join(scene.color.working_chromaticities(), " "));
  const OutputDescription& output = scene.description.output;
  if (!output.exr_layers && output.exr_type == ExrType::single) return write_image(file, render.linear, metadata);
  write_image(file, exr_of(render.linear, output), metadata);
}

void write_spectral(const std::filesystem::path& file, const Scene& scene, const Render& render) {
  ImageMetadata metadata = provenance(scene, render);
  metadata["chromaticities"] = fmt::format("{}", fmt::join(scene.color.working_chromaticities(), " "));  // Of R, G, B.
  metadata.insert(render.spectral->metadata.begin(), render.spectral->metadata.end());
  write_image(file, render.spectral->image, metadata);
}

/// The channels of a picture on a plate as volumes of one slice, moved along the light into the middle of the field and
/// as thick as the field, so that they lie on it.
void write_maps(const std::filesystem::path& file, const Scene& scene, const Render& render) {
  const Plate& plate = *render.view->plate;
  const Eigen::Vector3d V = scene.description.light.direction->normalized();
  const DepthRange range = depth_range(scene.field, plate.center, V);
  VoxelImage maps;
  maps.size = {render.linear.width, render.linear.height, 1};
  maps.names = render.linear.channels;
  const Eigen::Vector2d pixel = plate.pixel_size();
  maps.to_world.linear() << pixel.x() * plate.right, pixel.y() * plate.up, (range.far - range.near) * plate.normal();
  maps.to_world.translation() = plate.to_world({0.5, plate.resolution.y() - 0.5}) + 0.5 * (range.near + range.far) * V;
  maps.to_world = scene.description.turn().transpose() * maps.to_world;
  const std::size_t channels = maps.names.size();
  for (std::size_t channel = 0; channel < channels; ++channel)
    for (int y = render.linear.height - 1; y >= 0; --y)  // Rows of pictures come from the top.
      for (int x = 0; x < render.linear.width; ++x) maps.values.push_back(render.linear.pixel(x, y)[channel]);
  write_voxel_image(file, maps);
}

constexpr double unseen = 0.5;  // Grey of wavelengths that the eye does not see.
constexpr double pale = 0.03;   // Part of white in the colour of a wavelength, which makes it reproducible.

/// Draws what the scene asks for, and the picture has. Lines of text and a legend beside the picture make it larger.
/// @param coarseness  Of a preview (> 1), only lines of bodies are drawn.
void draw_annotations(const Scene& scene, const Render& render, double exposure, int coarseness, Image& image) {
  const OutputDescription& output = scene.description.output;
  const FieldUnits units = units_of(scene);
  draw_outline(image, render.outline, output.wants(Annotation::body), output.wants(Annotation::hidden));
  const bool is_lettered = coarseness == 1;
  if (render.view && is_lettered) {
    const Eigen::Vector3d &right = render.view->right, &up = render.view->up;
    if (output.wants(Annotation::scale)) draw_scale_bar(image, render.view->pixel_size, units.length);
    if (output.wants(Annotation::axes)) draw_axes(image, right, up);
    if (units.is_anatomical && (output.wants(Annotation::axes) || output.default_annotations))
      draw_anatomy(image, right, up, render.draw_legend ? render.legend_room : 0);
  }
  if (render.draw_legend) {
    if (render.legend_room == 0) image = with_room_beside(image, coarseness);
    if (is_lettered) render.draw_legend(image, exposure);
  }
  for (const std::string& line : {render.legend_note, output.caption})
    if (!line.empty()) {
      image = with_room_below(image, coarseness);
      if (is_lettered) draw_caption(image, line);
    }
}

/// The value of R, G or B that 99% of the lit pixels of a scene-linear picture do not exceed; nothing if it is black.
std::optional<double> brightest_hundredth(const Image& linear) {
  // A pixel is lit above this part of the undisturbed light, or of the brightest pixel if that is darker.
  constexpr float lit = 0.02f;
  constexpr double brightest = 0.99;  // This fraction of the lit pixels is darker.
  const std::size_t channels = linear.channels.size();
  std::vector<float> values;
  for (std::size_t i = 0; i + 2 < linear.pixels.size(); i += channels)
    values.push_back(std::max({linear.pixels[i], linear.pixels[i + 1], linear.pixels[i + 2]}));
  const float brightest_value = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
  if (!(brightest_value > 0)) return std::nullopt;
  const float threshold = lit * std::min(1.0f, brightest_value);
  values.erase(std::remove_if(values.begin(), values.end(), [&](float value) { return value <= threshold; }),
               values.end());
  const auto bright = values.begin() + static_cast<std::ptrdiff_t>(brightest * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), bright, values.end());
  return *bright;
}

/// Puts diagonal lines behind a pixel with alpha, which becomes opaque.
/// @param divided  Whether its colours are divided by alpha.
void lay_hatch(Image& image, int x, int y, bool divided) {
  const int pitch = std::max(8, std::min(image.width, image.height) / 40);
  const std::array<float, 3> color = (x + y) % pitch < pitch / 4 ? hatch_line : hatch_ground;
  float* const pixel = image.pixel(x, y);
  for (std::size_t c = 0; c < 3; ++c) pixel[c] = pixel[c] * (divided ? pixel[3] : 1) + (1 - pixel[3]) * color[c];
  pixel[3] = 1;
}

}  // namespace

std::vector<Output> picture_outputs(const std::vector<Output>& more) {
  std::vector<Output> outputs{
      {"image", "display-referred picture", {".png", ".jpg", ".jpeg", ".tif", ".tiff"}, write_display},
      {"exr", "scene-linear picture", {".exr"}, write_linear}};
  outputs.insert(outputs.end(), more.begin(), more.end());
  return outputs;
}

Output spectral_output() {
  return {"spectral", "spectral picture, one channel for each band", {".exr"}, write_spectral, ".spectral.exr"};
}

Output maps_output() {
  return {"maps", "the channels of the EXR as volumes of one slice within the field", voxel_image_endings(),
          write_maps};
}

ImageMetadata provenance(const Scene& scene, const Render& render) {
  ImageMetadata metadata = render.metadata;
  metadata.insert({{"Software", "tensorray " TENSORRAY_VERSION},
                   {"tensorray:version", TENSORRAY_VERSION},
                   {"tensorray:scene", scene.description.text},
                   {"tensorray:seed", std::to_string(scene.description.seed)},
                   {"tensorray:scale", fmt::format("{:.17g}", scene.scale.scale)},
                   {"tensorray:ocio_config", utf8_of(scene.color.config_name())},
                   {"tensorray:color_space", scene.color.working_space()}});
  return metadata;
}

double display_exposure(const Scene& scene, const Render& render) {
  if (scene.description.output.exposure) return *scene.description.output.exposure;
  const bool is_soft = scene.color.view() == soft_highlights_view;
  // Soft highlights darken what is bright: half a stop more keeps the half of white.
  if (render.exposure) return *render.exposure + (is_soft ? 0.5 : 0);
  const std::optional<double> bright = brightest_hundredth(render.linear);
  if (!bright) return 0;
  // Soft highlights show undisturbed light (1) as 0.63 of white, and eight times as much not quite as white.
  if (is_soft) return std::log2(std::clamp(*bright, 1.0, 8.0) / *bright);
  constexpr double shown_as = 0.9;  // Display-linear.
  return std::log2(shown_as / *bright);
}

Image display_image(const Scene& scene, const Render& render, bool holds_alpha, int coarseness) {
  if (render.display) {
    Image image = *render.display;
    draw_annotations(scene, render, 0, coarseness, image);
    return image;
  }
  const Image& linear = render.linear;
  const double exposure = display_exposure(scene, render);
  const auto gain = static_cast<float>(std::exp2(exposure));
  const bool has_alpha = linear.channels.size() > 3 && linear.channels[3] == "A";
  const bool divides = has_alpha && holds_alpha;
  const std::size_t from = linear.channels.size(), to = has_alpha ? 4 : 3;
  Image image(linear.width, linear.height,
              {linear.channels.begin(), linear.channels.begin() + static_cast<std::ptrdiff_t>(to)});
  for (std::size_t i = 0; i < image.pixels.size() / to; ++i) {
    const float* const in = &linear.pixels[i * from];
    float* const out = &image.pixels[i * to];
    const float alpha = divides && in[3] > 0 ? in[3] : 1;
    for (int c = 0; c < 3; ++c) out[c] = gain * in[c] / alpha;
    if (has_alpha) out[3] = in[3];
    if (render.is_hatched && render.is_hatched(in)) {
      const auto at = static_cast<int>(i);
      lay_hatch(image, at % image.width, at / image.width, divides);
    }
  }
  draw_annotations(scene, render, exposure, coarseness, image);
  scene.color.to_display(image);
  return image;
}

void write_grids(const std::filesystem::path& file, const Scene& scene, const Render& render) {
  write_scalar_vdb(file, render.grids, provenance(scene, render));
}

PictureView picture_view(const Plate& plate) { return {plate.right, plate.up, plate.pixel_size().x(), plate}; }

PictureView picture_view(const Camera& camera) {
  const double pixel = pixel_size(camera, camera.position + camera.focus_distance * camera.forward);
  return {camera.right, camera.up, pixel, {}, camera.projection == Projection::perspective};
}

std::function<void(Image&, double)> light_legend(const Scene& scene) {
  const SceneDescription& description = scene.description;
  const ValueRange range{description.light.wavelength_min, description.light.wavelength_max};
  const Eigen::Matrix3d from_rec709 = scene.color.xyz_to_working() * rec709_to_xyz();
  const auto color = [=](double wavelength) -> Eigen::Vector3d { return from_rec709 * wavelength_color(wavelength); };
  ColorKey key;
  for (std::size_t i = 0; description.bending.rgb && i < scene.bands.size(); ++i) {
    const Eigen::Vector3d light = to_working(scene) * scene.bands[i].xyz;
    const double flexibility = (*description.bending.rgb)[static_cast<Eigen::Index>(i)];
    key.entries.push_back({fmt::format("s = {:.3g}", flexibility), light / light.maxCoeff()});
  }
  if (!description.bending.rgb && range.low == range.high)
    key.entries.push_back({fmt::format("{:g} nm", range.low), color(range.low)});
  return [=](Image& image, double exposure) {
    const std::string stops = fmt::format("{:+.1f} stops", exposure);
    if (!key.entries.empty()) return draw_color_key(image, {stops, key.entries});
    draw_color_bar(image, {"nm\n" + stops, range, [&](double at) { return color(range.value(at)); }});
  };
}

Eigen::Vector3d wavelength_color(double wavelength) {
  Eigen::Vector3d rgb = rec709_to_xyz().inverse() * observer(wavelength);
  rgb.array() -= std::min(0.0, rgb.minCoeff());
  const double greatest = rgb.maxCoeff();
  if (!(greatest > 0)) return Eigen::Vector3d::Constant(unseen);
  return rgb / greatest * (1 - pale) + Eigen::Vector3d::Constant(pale);
}

}  // namespace tensorray
