#include "scenes/render_lens.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "base/constants.h"
#include "integrators/lens/lens.h"
#include "renderer/color/reflectance.h"
#include "renderer/images/grid_lines.h"

namespace tensorray {
namespace {

constexpr double reference_wavelength = 550;  // nm: the channel next to it is that of the points.
constexpr int overlay_cells = 16;             // Along the image's shorter side.
constexpr double most_overlay_cells = 1e6;    // Too dense to be drawn.
constexpr int gap_part = 64;                  // Between pictures side by side: this part of one's width.

/// How the image's colours become light, channel by channel.
std::function<double(const Eigen::Vector3d&, std::size_t)> radiance_of(const Scene& scene) {
  if (scene.description.bending.rgb) {
    const Eigen::Matrix3d to_primaries = (scene.color.xyz_to_working() * rec709_to_xyz()).inverse();
    return [to_primaries](const Eigen::Vector3d& rgb, std::size_t channel) {
      return to_primaries.row(static_cast<Eigen::Index>(channel)).dot(rgb);
    };
  }
  // Light that has no white cannot tell what spectrum a colour stands for: daylight does.
  const std::vector<Band> bands = has_white(scene) ? scene.bands : make_bands(illuminant("D65"), 380, 730, 36);
  Eigen::Vector3d white = Eigen::Vector3d::Zero();
  for (const Band& band : bands) white += band.xyz;
  const ReflectanceModel model(bands, scene.color.xyz_to_working_adapted(white));
  return [model, &scene](const Eigen::Vector3d& rgb, std::size_t channel) {
    return model.spectrum(rgb).at(scene.bands[channel].wavelength);
  };
}

std::size_t reference_channel(const Scene& scene) {
  if (scene.description.bending.rgb) return 1;
  const auto nearest = std::min_element(scene.bands.begin(), scene.bands.end(), [](const Band& a, const Band& b) {
    return std::abs(a.wavelength - reference_wavelength) < std::abs(b.wavelength - reference_wavelength);
  });
  return static_cast<std::size_t>(nearest - scene.bands.begin());
}

/// The points' channels, in this order.
const std::vector<std::string> point_channels{"texture.s",
                                              "texture.t",
                                              "displacement.x",
                                              "displacement.y",
                                              "displacement.z",
                                              "magnification.log",
                                              "magnification.major",
                                              "magnification.minor",
                                              "folds",
                                              "length",
                                              "end"};

void write_point(const LensPoint& point, float* values) {
  const auto finite = [](double value) { return std::clamp(value, -100.0, 100.0); };
  const auto next = [&values](double value) { *values++ = static_cast<float>(value); };
  for (int i = 0; i < 2; ++i) next(point.st[i]);
  for (int i = 0; i < 3; ++i) next(point.displacement[i]);
  for (const double logarithm : {point.log_magnification, point.log_stretch[0], point.log_stretch[1]})
    next(finite(logarithm));
  next(point.folds);
  next(point.length);
  next(static_cast<int>(point.end));
}

/// R, G, B, A, and what the points say.
Image make_image(const LensPicture& picture, const std::vector<Band>& bands, const Eigen::Matrix3d& to_rgb) {
  const Image colors = linear_image(picture.radiance, bands, to_rgb);
  std::vector<std::string> channels{"R", "G", "B", "A"};
  channels.insert(channels.end(), point_channels.begin(), point_channels.end());
  Image image(colors.width, colors.height, channels);
  for (std::size_t i = 0; i < picture.points.size(); ++i) {
    float* const pixel = &image.pixels[i * channels.size()];
    std::copy_n(&colors.pixels[3 * i], 3, pixel);
    pixel[3] = static_cast<float>(std::min(picture.alpha[i], 1.0));  // Rounding may sum to more than 1.
    write_point(picture.points[i], pixel + 4);
  }
  return image;
}

/// Straight lines as without the field, and the image's own as the lens bends them.
void draw_overlay(const LensPicture& picture, const Plate& plane, Image& image) {
  std::vector<PixelCoordinates> straight, seen;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const LensPoint& point = picture.points[static_cast<std::size_t>(y) * image.width + x];
      straight.push_back({true, picture.straight * Eigen::Vector2d(x + 0.5, y + 0.5), picture.straight.linear()});
      seen.push_back({point.end == LensEnd::image, point.st, point.per_pixel});
    }
  const Eigen::Array2d cells =
      (overlay_cells * plane.size / plane.size.minCoeff()).array().round().min(most_overlay_cells);
  GridLines lines;
  lines.cells = cells.cast<int>();
  lines.width = 1;
  lines.color = {0.05, 0.3, 0.9};
  lines.opacity = 0.5;
  draw_grid_lines(image, straight, lines);
  lines.width = 1.75;
  lines.color = {0.9, 0.15, 0.02};
  lines.opacity = 0.9;
  draw_grid_lines(image, seen, lines);
}

/// Pictures side by side, with a gap in which everything is 0.
Image side_by_side(const std::vector<Image>& images) {
  if (images.size() == 1) return images.front();
  const int width = images.front().width, gap = std::max(1, width / gap_part);
  const int count = static_cast<int>(images.size());
  Image all(count * width + (count - 1) * gap, images.front().height, images.front().channels);
  for (int i = 0; i < count; ++i)
    for (int y = 0; y < all.height; ++y)
      std::copy_n(images[static_cast<std::size_t>(i)].pixel(0, y), width * all.channels.size(),
                  all.pixel(i * (width + gap), y));
  return all;
}

void add_statistics(const LensPicture& picture, Statistics& statistics) {
  statistics.ends.resize(picture.ends.size());
  for (std::size_t channel = 0; channel < picture.ends.size(); ++channel)
    for (int end = 0; end < ray_end_count; ++end) statistics.ends[channel][end] += picture.ends[channel][end];
  statistics.ray_steps += picture.counts.ray_steps;
  statistics.tensor_samples += picture.counts.tensor_samples;
  statistics.seconds_tracing += picture.seconds_tracing;
}

std::string end_codes() {
  std::string text;
  for (int end = 0; end < lens_end_count; ++end)
    text += fmt::format("{}{} {}", end ? ", " : "", end, to_string(static_cast<LensEnd>(end)));
  return text;
}

}  // namespace

Render render_lens(const Scene& scene, const Progress& progress) {
  const SceneDescription& description = scene.description;
  const LensDescription& lens = description.integrator.lens;
  LensSettings settings;
  settings.mode = lens.mode;
  settings.samples = lens.samples;
  settings.reference = reference_channel(scene);
  LensImage image;
  image.texture = &scene.lens->image;
  image.wraps = scene.lens->wraps;
  image.radiance = radiance_of(scene);

  Render result;
  const Eigen::Matrix3d matrix = to_working(scene);
  std::vector<Image> pictures;
  std::vector<SpectralImage> spectra;
  for (const Plate& plane : scene.lens->planes) {
    image.plane = plane;
    const LensPicture picture = simulate_lens(scene.field, scene.geometry.surfaces(), scene.bending, scene.channels,
                                              scene.beam.direction, scene.lens->receiver, image, settings, progress);
    pictures.push_back(make_image(picture, scene.bands, matrix));
    if (lens.overlay == Overlay::grid) draw_overlay(picture, plane, pictures.back());
    add_statistics(picture, result.statistics);
    if (description.output.spectral.empty()) continue;
    // A white image is a diffuse one in the light of the scene.
    spectra.push_back(spectral_image(picture.radiance, scene.bands, description.light.irradiance / pi, matrix));
  }
  result.linear = side_by_side(pictures);
  if (!spectra.empty()) {
    std::vector<Image> images;
    for (SpectralImage& spectrum : spectra) images.push_back(std::move(spectrum.image));
    result.spectral = {side_by_side(images), spectra.front().metadata};
    result.spectral->metadata["emissiveUnits"] = "W.m^-2.sr^-1.nm^-1";
  }
  for (const std::uint64_t count : result.statistics.ends[settings.reference]) result.statistics.positions += count;
  result.metadata["tensorray:end"] = end_codes();
  result.exposure = 0;  // The image is shown as it is.
  return result;
}

}  // namespace tensorray
