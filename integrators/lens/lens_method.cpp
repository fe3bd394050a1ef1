#include "integrators/lens/lens_method.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "base/constants.h"
#include "renderer/charts/ink.h"
#include "renderer/spectra/reflectance.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/body_outline.h"
#include "scenes/outputs/channel_table.h"
#include "scenes/outputs/picture_outputs.h"
#include "tracing/flow_drawing/caustic.h"

namespace tensorray {
namespace {

constexpr int overlay_cells = 16;          // Cells along the image's shorter side.
constexpr double max_overlay_cells = 1e6;  // A limit; grids are too dense to be visible long before.
/// The light of a band is spread evenly over the points that it sees; so this step decides only how exact the colours
/// within a fringe are. With 10 bands or more a reflectance can have any colour of Rec. 709.
constexpr BandStep band_step{16, 12, 24};
constexpr int gap_part = 64;  // The gap between pictures side by side is the width of a picture divided by this.

/// A function that converts a colour of the image to its radiance in some bands.
LensRadiance radiance_in(const std::vector<FineBand>& fine, const Scene& scene) {
  if (scene.description.bending.rgb) {
    const Eigen::Matrix3d to_primaries = (scene.color.xyz_to_working() * rec709_to_xyz()).inverse();
    return [to_primaries](const Eigen::Vector3d& rgb, std::size_t first, std::size_t last, double* radiances) {
      const Eigen::Vector3d primaries = to_primaries * rgb;
      std::copy(primaries.data() + first, primaries.data() + last, radiances);
    };
  }
  std::vector<Band> bands;
  for (const FineBand& each : fine) bands.push_back(each.band);
  // Light that has no white does not define the spectrum of a colour. Daylight is used for it instead.
  const std::vector<Band> light = has_white(scene) ? bands : make_bands(illuminant("D65"), 380, 730, 36);
  Eigen::Vector3d white = Eigen::Vector3d::Zero();
  for (const Band& band : light) white += band.xyz;
  const ReflectanceModel model(light, scene.color.xyz_to_working_adapted(white));
  return [model, bands](const Eigen::Vector3d& rgb, std::size_t first, std::size_t last, double* radiances) {
    const ReflectanceSpectrum spectrum = model.spectrum(rgb);
    for (std::size_t i = first; i < last; ++i) radiances[i - first] = spectrum.at(bands[i].wavelength);
  };
}

std::vector<LensBand> lens_bands(const std::vector<FineBand>& fine, const Scene& scene) {
  const Eigen::Matrix3d xyz_to_working = to_working(scene);
  std::vector<LensBand> bands;
  for (const FineBand& each : fine)
    bands.push_back({each.begin, each.end, each.channel, each.weight, xyz_to_working * each.band.xyz});
  return bands;
}

/// What is known of a pixel.
struct LensPixel {
  Eigen::Vector3f color;
  double alpha;
  const LensPoint& point;
};

double bounded(double logarithm) { return std::clamp(logarithm, -100.0, 100.0); }

ChannelTable<LensPixel> lens_channels() {
  using Pixel = const LensPixel&;
  return {
      {{"R", "G", "B"}, [](Pixel pixel) { return pixel.color; }},
      {{"A"}, [](Pixel pixel) { return pixel.alpha; }},
      {{"texture.s", "texture.t"}, [](Pixel pixel) { return pixel.point.st; }},
      {{"displacement.x", "displacement.y", "displacement.z"}, [](Pixel pixel) { return pixel.point.displacement; }},
      {{"magnification.log"}, [](Pixel pixel) { return bounded(pixel.point.log_magnification); }},
      {{"magnification.major", "magnification.minor"},
       [](Pixel pixel) -> Eigen::Vector2d {
         return {bounded(pixel.point.log_stretch[0]), bounded(pixel.point.log_stretch[1])};
       }},
      {{"folds"}, [](Pixel pixel) { return pixel.point.folds; }},
      {{"length"}, [](Pixel pixel) { return pixel.point.length; }},
      {{"end"}, [](Pixel pixel) { return static_cast<int>(pixel.point.end); }}};
}

Image make_image(const LensPicture& picture) {
  const Image colors = color_image(picture.color);
  const ChannelTable<LensPixel> table = lens_channels();
  Image image(colors.width, colors.height, channel_names(table));
  for (std::size_t i = 0; i < picture.points.size(); ++i)
    write_channels(table, {Eigen::Vector3f(&colors.pixels[3 * i]), picture.alpha[i], picture.points[i]},
                   &image.pixels[i * image.channels.size()]);
  return image;
}

/// Draws the lines of a grid on the image twice: straight as without the field, and distorted as the lens shows them.
void draw_overlay(const LensPicture& picture, const Plate& plane, Image& image) {
  std::vector<PixelCoordinates> straight, seen;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const LensPoint& point = picture.points[static_cast<std::size_t>(y) * image.width + x];
      straight.push_back({true, picture.straight * Eigen::Vector2d(x + 0.5, y + 0.5), picture.straight.linear()});
      seen.push_back({point.end == LensEnd::image, point.st, point.per_pixel});
    }
  const Eigen::Array2d cells =
      (overlay_cells * plane.size / plane.size.minCoeff()).array().round().min(max_overlay_cells);
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

/// Puts pictures side by side. All channels are 0 in the gaps.
Image side_by_side(std::vector<Image> images) {
  if (images.size() == 1) return std::move(images.front());
  const int width = images.front().width, gap = std::max(1, width / gap_part);
  const int count = static_cast<int>(images.size());
  Image all(count * width + (count - 1) * gap, images.front().height, images.front().channels);
  for (int i = 0; i < count; ++i)
    for (int y = 0; y < all.height; ++y)
      std::copy_n(images[static_cast<std::size_t>(i)].pixel(0, y), width * all.channels.size(),
                  all.pixel(i * (width + gap), y));
  return all;
}

/// @param starts  Of the map.
void add_statistics(const LensPicture& picture, std::size_t starts, Statistics& statistics) {
  statistics.emitted.resize(picture.ends.size());
  statistics.ends.resize(picture.ends.size());
  for (std::size_t channel = 0; channel < picture.ends.size(); ++channel) {
    statistics.emitted[channel] += starts;
    for (int end = 0; end < ray_end_count; ++end) statistics.ends[channel][end] += picture.ends[channel][end];
  }
  statistics.ray_steps += picture.counts.ray_steps;
  statistics.tensor_samples += picture.counts.tensor_samples;
  statistics.seconds_drawing += picture.seconds_drawing;
}

std::string end_codes() {
  std::string text;
  for (int end = 0; end < lens_end_count; ++end)
    text += fmt::format("{}{} {}", end ? ", " : "", end, to_string(static_cast<LensEnd>(end)));
  return text;
}

/// The pictures of some depths, and their statistics.
struct LensPictures {
  std::vector<Image> pictures;
  std::vector<SpectralImage> spectra;
  Statistics statistics;
};

class LoadedLens : public LoadedMethod {
 public:
  LoadedLens(LensDescription settings, LensScene scene) : settings_(std::move(settings)), lens_(std::move(scene)) {}

  Render render(const Scene& scene, const Progress& progress, RenderJob* job) const override;

 private:
  LensSettings trace_settings(const Scene& scene) const;
  void add_picture(const Scene& scene, const LensLight& light, const Progress& progress, LensPictures& all) const;
  Render render_of(const Scene& scene, LensPictures all) const;

  LensDescription settings_;
  LensScene lens_;
};

/// Puts spectral pictures side by side.
SpectralImage spectra_side_by_side(std::vector<SpectralImage> spectra) {
  std::vector<Image> images;
  for (SpectralImage& spectrum : spectra) images.push_back(std::move(spectrum.image));
  SpectralImage all = std::move(spectra.front());
  all.image = side_by_side(std::move(images));
  return all;
}

LensSettings LoadedLens::trace_settings(const Scene& scene) const {
  LensSettings settings;
  settings.mode = settings_.mode;
  settings.samples = settings_.samples;
  settings.reference = reference_place(scene);
  const LightRange range = light_range(scene);
  settings.flexibilities = range.flexibilities;
  settings.range = range.is_range;
  if (settings_.obstacles == ObstacleLook::shaded) settings.obstacles = &scene.geometry.surfaces();
  return settings;
}

/// Draws the light of one depth. Of ranks, the root has the picture.
void LoadedLens::add_picture(const Scene& scene, const LensLight& light, const Progress& progress,
                             LensPictures& all) const {
  const int channels = static_cast<int>(scene.bands.size());
  const bool by_channel = scene.description.output.wants("spectral");
  const std::vector<FineBand> fine = fine_bands(scene, band_count(light.map, channels, band_step));
  const LensPicture picture =
      draw_lens(light, lens_bands(fine, scene), radiance_in(fine, scene), scene.bands.size(), by_channel, progress);
  add_statistics(picture, light.map.starts.size(), all.statistics);
  all.statistics.seconds_tracing += light.seconds_tracing;
  if (!is_root(light.settings.job ? light.settings.job->ranks : nullptr)) return;
  all.pictures.push_back(make_image(picture));
  if (settings_.overlay == Overlay::grid) draw_overlay(picture, light.setup.image.plane, all.pictures.back());
  if (by_channel)
    // A white image has the radiance of a white diffuse surface in the scene's light.
    all.spectra.push_back(spectral_image(picture.radiance, scene.bands, SpectralQuantity::radiance,
                                         scene.description.light.irradiance / pi, to_working(scene)));
}

Render LoadedLens::render_of(const Scene& scene, LensPictures all) const {
  Render result;
  const int width = all.pictures.front().width, count = static_cast<int>(all.pictures.size());
  result.linear = side_by_side(std::move(all.pictures));
  const std::vector<OutlineStroke> outline = body_outline(scene, lens_.receiver);
  for (int i = 0; i < count; ++i)
    for (const OutlineStroke& each : outline) {
      const Eigen::Vector2d right(i * (result.linear.width - width) / std::max(1, count - 1), 0);
      result.outline.push_back({each.from + right, each.to + right, each.is_hidden});
    }
  if (!all.spectra.empty()) result.spectral = spectra_side_by_side(std::move(all.spectra));
  result.statistics = std::move(all.statistics);
  result.statistics.positions = result.statistics.emitted[reference_channel(scene)];
  result.metadata["tensorray:end"] = end_codes();
  result.view = picture_view(lens_.receiver);
  result.exposure = 0;                        // Shows the colours of the image unchanged.
  if (settings_.empty == EmptyLook::hatched)  // All channels are 0 in the gaps between pictures.
    result.is_hatched = [end = result.linear.channels.size() - 1](const float* pixel) { return pixel[end] != 0; };
  if (nothing_arrived(result.statistics))
    result.warnings.push_back("no ray met the image; check `receiver` and `integrator.image_plane`");
  return result;
}

Render LoadedLens::render(const Scene& scene, const Progress& progress, RenderJob* job) const {
  LensSettings settings = trace_settings(scene);
  settings.job = job;
  const bool is_shard = job && job->is_shard;
  Ranks* const ranks = job ? job->ranks : nullptr;
  LensPictures all;
  if (job)
    settings.show = [&](const std::function<const LensLight&()>& so_far) {
      if (!job->takes_picture_request()) return;
      LensPictures shown = all;
      add_picture(scene, so_far(), progress, shown);
      job->show(render_of(scene, std::move(shown)));
    };
  LensImage image;
  image.texture = &lens_.image;
  image.wraps = lens_.wraps;
  for (const Plate& plane : lens_.planes) {
    image.plane = plane;
    const LensLight light = trace_lens(scene.field, scene.geometry.surfaces(), scene.bending,
                                       {lens_.receiver, image, scene.beam.direction}, settings, progress);
    if (!is_shard) add_picture(scene, light, progress, all);
  }
  gather_counts(ranks, all.statistics);
  return is_shard || !is_root(ranks) ? Render() : render_of(scene, std::move(all));
}

class LensMethod : public MethodWith<LensDescription> {
 public:
  const char* name() const override { return "lens"; }
  bool shows_plate() const override { return true; }

  std::vector<std::string> channels(const SceneDescription&) const override { return channel_names(lens_channels()); }

  std::vector<Output> outputs() const override { return picture_outputs({spectral_output(), maps_output()}); }

  std::vector<NamedFile> inputs() const override {
    const auto* file = std::get_if<std::filesystem::path>(&settings().image);
    return {{file ? *file : std::filesystem::path(), "`/integrator/image`"}};
  }

  void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const override {
    check_normal(settings().plane.normal, "/integrator/image_plane", scene.light, source);
    if (!chosen) return;
    default_annotations(scene, json, {Annotation::body});
    check_spectral_output(scene, source);
    warn_unused(scene, json, "/light/spectrum", "/bending/rgb");
    // While a depth is drawn: its points, films of colours and alpha, the picture and its colours, and the flow map; of
    // the other depths, and of all side by side, the pictures.
    const auto& depth = settings().plane.depth;
    const double more = depth && !depth->empty() ? static_cast<double>(depth->size() - 1) : 0;
    if (more > 0 && scene.output.wants("maps"))
      source.fail("`/output/maps` are of one image plane; give one `/integrator/image_plane/depth`");
    const double picture = static_cast<double>(channel_names(lens_channels()).size()) * sizeof(float);
    const double spectral = scene.output.wants("spectral") ? channel_count(scene) : 0;
    const double map = starts_per_pixel * 3 * sizeof(double);
    check_receiver_memory(scene,
                          sizeof(LensPoint) + 4 * sizeof(double) + picture + 7 * sizeof(float) + map +
                              spectral * (sizeof(double) + 2 * sizeof(float)) +
                              more * 2 * (picture + spectral * sizeof(float)),
                          source);
  }

  std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const override {
    return std::make_unique<LoadedLens>(settings(), load_lens(scene, settings(), notes));
  }
};

constexpr double default_image_distance = 0.25;  // Distance of the image before the volume, in depths of the volume.
constexpr int test_image_pixels = 4096;  // Most pixels along the longer side; otherwise 4 per pixel of the receiver.

Image load_test_image(TestImage which, const Plate& receiver, const ColorManagement& color) {
  const int longest = std::min(test_image_pixels, 4 * receiver.resolution.maxCoeff());
  const Eigen::Vector2d pixels = longest * receiver.size / receiver.size.maxCoeff();
  Image image = test_image(which, std::max(1, static_cast<int>(std::lround(pixels.x()))),
                           std::max(1, static_cast<int>(std::lround(pixels.y()))));
  const Eigen::Matrix3f to_working = (color.xyz_to_working() * rec709_to_xyz()).cast<float>();
  tbb::parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      Eigen::Map<Eigen::Vector3f> pixel(image.pixel(x, y));
      pixel = to_working * pixel;
    }
  });
  return image;
}

/// Whether the image continues beyond its edges. In the mode `scatter` light starts from the image only.
bool goes_on(const LensDescription& lens) { return lens.wrap != Wrap::none && lens.mode == LensMode::gather; }

Texture load_image(const LensDescription& lens, const Plate& receiver, const ColorManagement& color,
                   std::vector<std::string>& notes) {
  const Wrap wrap = goes_on(lens) ? lens.wrap : Wrap::clamp;  // The lens cuts clamped images sharply at their edges.
  if (const TestImage* which = std::get_if<TestImage>(&lens.image))
    return {load_test_image(*which, receiver, color), wrap};
  return {std::get<std::filesystem::path>(lens.image), color, lens.image_color_space, wrap, lens.image_layer, &notes};
}

/// The smallest rectangle in the proportions of the image that covers the receiver.
Eigen::Vector2d covering_size(const Plate& receiver, const Texture& image) {
  const double aspect = static_cast<double>(image.width()) / image.height();
  const Eigen::Vector2d size = receiver.size;
  // If the proportions agree up to rounding to pixels, the image has exactly the receiver's size.
  if (std::abs(aspect * size.y() / size.x() - 1) < 0.5 / std::max(image.width(), image.height())) return size;
  return {std::max(size.x(), size.y() * aspect), std::max(size.y(), size.x() / aspect)};
}

}  // namespace

std::shared_ptr<Method> lens_method() { return std::make_shared<LensMethod>(); }

LensScene load_lens(const Scene& scene, const LensDescription& lens, std::vector<std::string>& notes) {
  const Eigen::Vector3d& direction = scene.beam.direction;
  Plate receiver = *scene.geometry.surfaces().plate;
  receiver.right = -receiver.right;  // It is seen from its other side.
  LensScene result{load_image(lens, receiver, scene.color, notes), receiver, {}, goes_on(lens)};

  Plate plane = receiver;
  if (lens.plane.normal || lens.plane.up) {
    Eigen::Vector3d normal = lens.plane.normal.value_or(receiver.normal()).normalized();
    if (normal.dot(direction) < 0) normal = -normal;
    plane.up = upright(normal, lens.plane.up.value_or(receiver.up));
    plane.right = plane.up.cross(normal);
  }
  plane.size = lens.plane.size.value_or(covering_size(receiver, result.image));

  const DepthRange depths = depth_range(scene.field, Eigen::Vector3d::Zero(), direction);
  const double depth = depths.far - depths.near, receiver_at = receiver.center.dot(direction);
  const auto add = [&](const Eigen::Vector3d& center) {
    if (!(receiver.normal().dot(receiver.center - center) > 0))
      throw SceneError(
          fmt::format("{}: `/integrator/image_plane`: the image must be before the receiver, which is at depth {:.6g} "
                      "of the volume; move the image or the receiver",
                      scene.description.path.string(), (receiver_at - depths.near) / depth));
    plane.center = center;
    require_near(plane, "/integrator/image_plane", scene.description, scene.field);
    result.planes.push_back(plane);
  };
  const auto along = [&](double position) -> Eigen::Vector3d {
    return receiver.center + (position - receiver_at) * direction;
  };
  if (lens.plane.center) {
    add(*lens.plane.center);
  } else if (lens.plane.depth) {
    for (const double part : *lens.plane.depth) add(along(depths.near + part * depth));
  } else {
    add(along(depths.near - lens.plane.distance.value_or(default_image_distance * depth)));
  }
  return result;
}

}  // namespace tensorray
