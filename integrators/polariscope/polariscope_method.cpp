#include "integrators/polariscope/polariscope_method.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "base/constants.h"
#include "base/process/seconds.h"
#include "integrators/polariscope/load_polariscope.h"
#include "renderer/film/spectral_image.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/body_outline.h"
#include "scenes/outputs/channel_table.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/scene/kept_results.h"

namespace tensorray {
namespace {

constexpr std::size_t rows_per_round = 64;  // That are traced before others get them.
constexpr double few_orders = 0.02;         // A picture with fewer shows nothing,
constexpr double most_orders = 1000;        // and one with more shows grey.

/// What is known of a pixel.
struct PolarPixel {
  Eigen::Vector3f color;
  const PolarPoint& point;
  double nanometres;  ///< Of a phase of 1.
};

ChannelTable<PolarPixel> polariscope_channels() {
  using Pixel = const PolarPixel&;
  return {{{"R", "G", "B"}, [](Pixel pixel) { return pixel.color; }},
          {{"A"}, [](Pixel) { return 1; }},
          {{"retardance"}, [](Pixel pixel) { return pixel.nanometres * pixel.point.retarder.phase; }},
          {{"integral"}, [](Pixel pixel) { return pixel.nanometres * pixel.point.integral; }},
          {{"azimuth"}, [](Pixel pixel) { return pixel.point.retarder.azimuth; }},
          {{"rotation"}, [](Pixel pixel) { return pixel.point.retarder.rotation; }},
          {{"length"}, [](Pixel pixel) { return pixel.point.length; }}};
}

constexpr std::size_t integral_channel = 5, azimuth_channel = 6, length_channel = 8;

int spectral_channels(const SceneDescription& scene) {
  return scene.output.wants("spectral") ? channel_count(scene) * (scene.output.stokes ? 4 : 1) : 0;
}

/// The rows of a picture, as far as they are made.
struct PolarPicture {
  Image image;
  Film spectra;  ///< Powers of the bands, or S0 of all bands, then S1, S2 and S3; without channels if it is not wanted.
};

/// Turns traced light into the pixels of a row. @param nanometres  Of a phase of 1.
void draw_row(const PolarView& view, double nanometres, const LightRow& row, std::size_t y, PolarPicture& picture) {
  static const ChannelTable<PolarPixel> table = polariscope_channels();
  for (std::size_t x = 0; x < row.points.size(); ++x) {
    write_channels(table, {view.color(row, x), row.points[x], nanometres},
                   picture.image.pixel(static_cast<int>(x), static_cast<int>(y)));
    if (picture.spectra.channels == 0) continue;
    const Eigen::MatrixXf spectrum = view.spectrum(row, x);
    for (int c = 0; c < picture.spectra.channels; ++c)
      picture.spectra.plane(c)[y * row.points.size() + x] = spectrum(c);
  }
}

/// Radiance by bands. Its colours are the picture's.
SpectralImage spectral_picture(const PolarPicture& picture, const Scene& scene) {
  std::vector<Band> bands;
  while (bands.size() < static_cast<std::size_t>(picture.spectra.channels))
    bands.insert(bands.end(), scene.bands.begin(), scene.bands.end());
  SpectralImage result = spectral_image(picture.spectra, bands, SpectralQuantity::radiance,
                                        scene.description.light.irradiance / pi, to_working(scene));
  for (std::size_t c = 0; c < bands.size(); ++c)
    result.image.channels[3 + c][1] = static_cast<char>('0' + c / scene.bands.size());  // S0 to S3.
  for (int y = 0; y < picture.image.height; ++y)
    for (int x = 0; x < picture.image.width; ++x) std::copy_n(picture.image.pixel(x, y), 3, result.image.pixel(x, y));
  result.bands = scene.bands;
  if (scene.description.output.stokes) result.metadata["polarisationHandedness"] = "right";
  return result;
}

/// The magnitudes of the integrals of the picture's pixels in the field, nm.
std::vector<float> integrals_of(const Image& image) {
  std::vector<float> values;
  for (std::size_t i = 0; i < image.pixels.size(); i += image.channels.size())
    if (image.pixels[i + length_channel] > 0) values.push_back(std::abs(image.pixels[i + integral_channel]));
  return values;
}

class LoadedPolariscope : public LoadedMethod {
 public:
  LoadedPolariscope(PolariscopeDescription settings, LoadedLightOfPolariscope loaded)
      : settings_(std::move(settings)), loaded_(std::move(loaded)) {}

  Render render(const Scene& scene, const Progress& progress, RenderJob* job) const override;

  Strength strength(const Scene&) const override {
    return {"integrator", "stress_optic", loaded_.stress_optic,
            std::holds_alternative<std::filesystem::path>(settings_.stress_optic)};
  }

 private:
  using Rows = std::vector<LightRow>;

  std::string traced_key(const Scene& scene) const;
  Render render_of(const Scene& scene, Image picture) const;

  PolariscopeDescription settings_;
  LoadedLightOfPolariscope loaded_;
};

/// All that traced light and its sums depend on, the field aside.
std::string LoadedPolariscope::traced_key(const Scene& scene) const {
  Json json = Json::parse(scene.description.text);
  for (const char* key : {"output", "camera", "lights", "objects", "seed"}) json.erase(key);
  for (const char* key : scene.description.integrator.method().analysis_keys()) json["integrator"].erase(key);
  std::string key = json.dump();
  for (const NamedFile& input : input_files(scene.description)) {
    std::error_code none;
    key += fmt::format(" {}", std::filesystem::last_write_time(input.path, none).time_since_epoch().count());
  }
  for (const double value : band_colors(scene).reshaped().eval()) key += fmt::format(" {}", value);
  const Eigen::Vector3d& V = loaded_.light.direction;
  return key + fmt::format(" {} {} {} {}", V.x(), V.y(), V.z(), loaded_.stress_optic);
}

/// The slow axis, of an order that is not wrapped. @param azimuth  Of the wrapped retardance, of which the other axis
/// is the slow one in the upper half of an order.
double slow_axis(double order, double azimuth) {
  if (order - std::floor(order) <= 0.5) return azimuth;
  return azimuth > 0 ? azimuth - pi / 2 : azimuth + pi / 2;
}

/// What is shown of the picture, which may not be complete.
Render LoadedPolariscope::render_of(const Scene& scene, Image picture) const {
  std::vector<float> integrals = integrals_of(picture);
  Render result;
  result.linear = std::move(picture);
  result.exposure = 0;
  const Plate& plate = *scene.geometry.surfaces().plate;
  result.view = picture_view(plate);
  result.outline = body_outline(scene, plate);
  const double greatest = integrals.empty() ? 0 : *std::max_element(integrals.begin(), integrals.end());
  const double order = greatest / loaded_.wavelength;
  result.notes.push_back(
      fmt::format("greatest order: {:.3g} at {:g} nm (retardance {:.4g} nm)", order, loaded_.wavelength, greatest));
  const bool too_small = greatest > 0 && order < few_orders;
  if (too_small || order > most_orders)
    result.warnings.push_back(
        fmt::format("{}; check the units of `integrator.stress_optic` and `integrator.unit_length`, or leave the first "
                    "to \"auto\"",
                    too_small ? "the picture shows almost nothing: the retardance is far below a wavelength"
                              : "fringes are too fine to be seen: the retardance is more than a thousand wavelengths"));
  result.metadata = {{"tensorray:stress_optic", fmt::format("{:.17g}", loaded_.stress_optic)},
                     {"tensorray:wavelength", fmt::format("{:.17g}", loaded_.wavelength)}};
  if (scene.description.output.wants(Annotation::legend)) {
    const double shown = greatest_of_most(integrals);
    result.draw_legend = polariscope_legend(scene, loaded_, shown > 0 ? shown : loaded_.wavelength);
    result.legend_note = loaded_.order_note;
  }
  result.describe_pixel = [wavelength = loaded_.wavelength](const float* pixel) {
    const double n = std::abs(pixel[integral_channel]) / wavelength, axis = slow_axis(n, pixel[azimuth_channel]);
    return std::vector<std::pair<std::string, std::string>>{
        {"order", fmt::format("{:.3f} at {:.1f} nm", n, wavelength)},
        {"slow axis", fmt::format("{:.1f} degrees", axis * 180 / pi)}};
  };
  return result;
}

Render LoadedPolariscope::render(const Scene& scene, const Progress& progress, RenderJob* job) const {
  const auto start = Clock::now();
  const Plate& plate = *scene.geometry.surfaces().plate;
  const PolarTracer tracer(scene.field, scene.geometry, loaded_.light, plate);
  const PolarView view(loaded_.arrangement, loaded_.light.bands, band_colors(scene), scene.description.output.stokes);
  const double nanometres = loaded_.wavelength / (2 * pi);
  const auto width = static_cast<std::size_t>(plate.resolution.x()),
             height = static_cast<std::size_t>(plate.resolution.y());
  PolarPicture picture{{plate.resolution.x(), plate.resolution.y(), channel_names(polariscope_channels())}, {}};
  picture.spectra = {plate.resolution.x(), plate.resolution.y(), spectral_channels(scene.description)};

  const std::string key = traced_key(scene);
  const std::shared_ptr<const Rows> known = scene.kept ? scene.kept->find<Rows>(key) : nullptr;
  // Sums are enough for the colours of most arrangements. Bands are kept only where there is room for them.
  const bool needs_bands = !view.is_achromatic() || picture.spectra.channels > 0;
  const std::size_t pixel_bytes = sizeof(PolarPoint) + 30 * sizeof(float);
  const std::size_t bytes_with_bands = width * height * (pixel_bytes + 10 * tracer.room() * sizeof(float));
  const bool keeps = scene.kept && !known, keeps_bands = bytes_with_bands <= KeptResults::max_bytes;
  Rows traced(keeps ? height : 0);

  Units rows;
  rows.count = height;
  rows.kind = "polarised row";
  rows.round = rows_per_round;
  rows.make = [&](std::size_t y) {
    const bool is_enough = known && !(needs_bands && (*known)[y].bands.empty());
    if (is_enough) return draw_row(view, nanometres, (*known)[y], y, picture);
    LightRow row = tracer.row(static_cast<int>(y));
    view.set_sums(row);
    draw_row(view, nanometres, row, y, picture);
    if (!keeps_bands) row.bands = std::vector<float>();
    if (keeps) traced[y] = std::move(row);
  };
  rows.copy = [&](std::size_t y, Archive& archive) {
    archive.copy(picture.image.pixel(0, static_cast<int>(y)), width * picture.image.channels.size() * sizeof(float));
    for (int c = 0; c < picture.spectra.channels; ++c)
      archive.copy(picture.spectra.plane(c) + y * width, width * sizeof(double));
  };
  if (job)
    rows.shown = [&] {
      if (job->takes_picture_request()) job->show(render_of(scene, picture.image));
    };
  make_units(rows, job, "tracing rays", progress);
  if (keeps) scene.kept->keep(key, std::move(traced), keeps_bands ? bytes_with_bands : width * height * pixel_bytes);
  if (job && (job->is_shard || !is_root(job->ranks))) return {};

  std::optional<SpectralImage> spectral;
  if (picture.spectra.channels > 0) spectral = spectral_picture(picture, scene);
  Render result = render_of(scene, std::move(picture.image));
  result.spectral = std::move(spectral);
  result.statistics.seconds_tracing = seconds_since(start);
  return result;
}

class PolariscopeMethod : public MethodWith<PolariscopeDescription> {
 public:
  const char* name() const override { return "polariscope"; }
  bool shows_plate() const override { return true; }
  bool bends_light() const override { return false; }
  std::vector<const char*> analysis_keys() const override { return {"arrangement", "angle", "analyzer"}; }

  std::vector<std::string> channels(const SceneDescription&) const override {
    return channel_names(polariscope_channels());
  }

  std::vector<Output> outputs() const override { return picture_outputs({spectral_output(), maps_output()}); }

  std::vector<NamedFile> inputs() const override {
    const auto* file = std::get_if<std::filesystem::path>(&settings().stress_optic);
    return {{file ? *file : std::filesystem::path(), "`/integrator/stress_optic`"}};
  }

  /// Bends nothing: the scale is not chosen, and eigenvalues stay what they are.
  void check(SceneDescription& scene, const Json& json, const SceneSource& source, bool chosen) const override {
    if (!chosen) {
      if (given(json, "/output/stokes"))
        scene.warnings.push_back("`/output/stokes` has no effect: it belongs to the method \"polariscope\"");
      return;
    }
    default_annotations(scene, json, {Annotation::body});
    if (scene.bending.rgb) source.fail("`/bending/rgb`: the polariscope needs light with wavelengths; remove it");
    if (given(json, "/field/scale"))
      scene.warnings.push_back("`/field/scale` has no effect with polariscope; its key is `/integrator/stress_optic`");
    if (scene.field.eigenvalues == Eigenvalues::automatic) scene.field.eigenvalues = Eigenvalues::raw;
    if (scene.field.eigenvalues != Eigenvalues::raw)
      scene.warnings.push_back(
          "`/field/eigenvalues`: the polariscope shows differences of principal values, which these change; \"auto\" "
          "keeps them");
    if (settings().analyzer != 0 && !last_polarizer(settings().arrangement.after))
      scene.warnings.push_back("`/integrator/analyzer` has no effect: `after` has no polarizer that it could turn");
    scene.field.scale = 1;
    scene.bending.flexibility = {0, 0};  // Of the rays that the live view draws.
    if (scene.output.stokes && !scene.output.wants("spectral"))
      scene.warnings.push_back("`/output/stokes` has no effect without `/output/spectral`");
    const double picture = static_cast<double>(channel_names(polariscope_channels()).size()) * sizeof(float);
    check_receiver_memory(scene, 2 * picture + spectral_channels(scene) * (2.0 * sizeof(float) + sizeof(double)),
                          source);
  }

  std::unique_ptr<const LoadedMethod> load(const Scene& scene, std::vector<std::string>& notes) const override {
    return std::make_unique<LoadedPolariscope>(settings(), load_polariscope(scene, settings(), notes));
  }
};

}  // namespace

std::shared_ptr<Method> polariscope_method() { return std::make_shared<PolariscopeMethod>(); }

}  // namespace tensorray
