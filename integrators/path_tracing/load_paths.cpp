#include "integrators/path_tracing/load_paths.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "base/constants.h"
#include "integrators/path_files/path_files.h"
#include "integrators/seeds/seeds.h"
#include "renderer/images/image.h"
#include "scenes/scene/turning.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {
namespace {

constexpr double shown_min = 380, shown_max = 730;  // nm: range of the light that shows the paths.
constexpr double reference_wavelength = 550;        // nm: wavelength of the rays, unless paths show their wavelength.
constexpr std::size_t max_paths = 2'000'000;        // A path takes some kilobytes.

/// The light that shows the paths. Its white is always neutral, unlike that of the light that is bent.
ShownLight shown_light(const ColorManagement& color, const Spectrum& light, int count) {
  std::vector<Band> bands = make_bands(light, shown_min, shown_max, count);
  Eigen::Vector3d white = Eigen::Vector3d::Zero();
  for (const Band& band : bands) white += band.xyz;
  const Eigen::Matrix3d matrix = color.xyz_to_working_adapted(white);
  ReflectanceModel model(bands, matrix);
  return {std::move(bands), matrix, color.xyz_to_working() * rec709_to_xyz(), std::move(model)};
}

std::vector<Eigen::Vector3d> line_positions(const SeedDescription& seeds, const Eigen::AlignedBox3d& box,
                                            const Beam& beam) {
  const double half = 0.45 * box.sizes().dot(beam.right.cwiseAbs());
  return line_seeds(seeds.from.value_or(box.center() - half * beam.right),
                    seeds.to.value_or(box.center() + half * beam.right), seeds.count);
}

std::vector<Eigen::Vector3d> threshold_positions(const SeedDescription& seeds, const TensorField& field,
                                                 std::uint64_t seed) {
  if (!seeds.above && !seeds.below) throw std::invalid_argument("the kind \"threshold\" needs `above` or `below`");
  Threshold threshold{seeds.invariant};
  if (seeds.above) threshold.min = *seeds.above;
  if (seeds.below) threshold.max = *seeds.below;
  return threshold_seeds(field, threshold, seeds.count, seed);
}

SeedList turned(SeedList seeds, const Eigen::Matrix3d& turn) {
  for (auto* vectors : {&seeds.positions, &seeds.directions})
    for (Eigen::Vector3d& vector : *vectors) vector = turn * vector;
  return seeds;
}

SeedList seed_list(const Scene& scene, const SeedDescription& seeds) {
  const TensorField& field = scene.field;
  const Beam& beam = scene.beam;
  const std::uint64_t seed = scene.description.seed;
  const Eigen::AlignedBox3d box = field.world_box();
  if (seeds.kind == SeedKind::grid) return {grid_seeds(beam, seeds.count), {}};
  if (seeds.kind == SeedKind::poisson_disk) return {poisson_disk_seeds(beam, seeds.count, seed), {}};
  if (seeds.kind == SeedKind::line) return {line_positions(seeds, box, beam), {}};
  if (seeds.kind == SeedKind::threshold) return {threshold_positions(seeds, field, seed), {}};
  if (seeds.kind == SeedKind::sphere)
    return {sphere_seeds(seeds.center.value_or(box.center()), seeds.radius.value_or(box.sizes().minCoeff() / 4),
                         seeds.count, seed),
            {}};
  if (seeds.file.empty())
    throw std::invalid_argument("the kind \"file\" needs `file`, a text file with x y z in each line");
  return turned(read_seeds(seeds.file), scene.description.turn());
}

/// The channels that are followed from every seed: all of them if the colour of paths is their wavelength, otherwise
/// the one nearest to the reference wavelength. The three channels of RGB mode get the paper's wavelengths for them.
std::vector<LightChannel> followed(std::vector<LightChannel> channels, bool rgb, PathColor by) {
  if (rgb)
    for (std::size_t i = 0; i < 3; ++i) channels[i].wavelength = 650 - 100 * static_cast<double>(i);
  if (by == PathColor::wavelength) return channels;
  return {*std::min_element(channels.begin(), channels.end(), [](const LightChannel& a, const LightChannel& b) {
    return std::abs(a.wavelength - reference_wavelength) < std::abs(b.wavelength - reference_wavelength);
  })};
}

std::vector<PathSeed> seeds_of(const SeedList& list, const std::vector<LightChannel>& channels, const Beam& beam) {
  const std::size_t count = list.positions.size() * channels.size();
  if (count > max_paths)
    throw std::invalid_argument(fmt::format("{} seeds with {} wavelengths are more than {} paths; ask for fewer",
                                            list.positions.size(), channels.size(), max_paths));
  std::vector<PathSeed> seeds;
  seeds.reserve(count);
  for (std::size_t i = 0; i < list.positions.size(); ++i)
    for (const LightChannel& channel : channels)
      seeds.push_back({list.positions[i], list.directions.empty() ? beam.direction : list.directions[i],
                       channel.flexibility, channel.wavelength});
  return seeds;
}

/// Gives each channel of the picture the spectrum of its primary of Rec. 709, which reflectances can have. Spectra add
/// as colours do, so that every colour of the picture is then right.
EnvironmentLight load_environment(const LightSourceDescription& description, const ColorManagement& color,
                                  const ShownLight& light, std::vector<std::string>& notes) {
  EnvironmentLight environment;
  environment.picture =
      load_rec709({description.file, description.layer}, color, light.rec709_to_working.inverse(), notes);
  environment.channel_spectra.resize(static_cast<Eigen::Index>(light.bands.size()), 3);
  for (int c = 0; c < 3; ++c) {
    const std::vector<float> spectrum =
        light.radiance(Eigen::Vector3d::Unit(c), description.strength * description.color[c]);
    environment.channel_spectra.col(c) =
        Eigen::Map<const Eigen::VectorXf>(spectrum.data(), static_cast<Eigen::Index>(spectrum.size()));
  }
  environment.to_world = Eigen::AngleAxisd(description.rotation * pi / 180, Eigen::Vector3d::UnitZ()).matrix();
  return environment;
}

/// Counts paths by channel and end. Paths of a file with a flexibility that no channel has count for the first one.
void count_ends(const Scene& scene, const std::vector<Path>& paths, Statistics& statistics) {
  statistics.positions = paths.size();
  statistics.emitted.assign(scene.channels.size(), 0);
  statistics.ends.assign(scene.channels.size(), EndCounts{});
  for (const Path& path : paths) {
    const auto found = std::find_if(scene.channels.begin(), scene.channels.end(), [&](const LightChannel& channel) {
      return channel.flexibility == path.flexibility;
    });
    const auto channel = found == scene.channels.end() ? 0 : found - scene.channels.begin();
    ++statistics.emitted[static_cast<std::size_t>(channel)];
    ++statistics.ends[static_cast<std::size_t>(channel)][static_cast<std::size_t>(path.end)];
  }
}

}  // namespace

Image load_rec709(const PictureFile& file, const ColorManagement& color, const Eigen::Matrix3d& to_rec709,
                  std::vector<std::string>& notes) {
  const NativeImage native = read_native_image(file.path, file.layer);
  add_notes(file.path, native, notes);
  const ColorConversion to_working = color.picture_conversion(file.path, native, "", notes);
  Image image(native.width, native.height, {"R", "G", "B"});
  std::vector<float> row(4 * static_cast<std::size_t>(native.width));
  for (int y = 0; y < native.height; ++y) {
    read_pixels(native, 0, y, native.width, row.data());
    if (to_working) to_working(row.data(), static_cast<std::size_t>(native.width));
    for (int x = 0; x < native.width; ++x)
      Eigen::Map<Eigen::Vector3f>(image.pixel(x, y)) =
          to_rec709.cast<float>() * Eigen::Map<const Eigen::Vector3f>(&row[4 * static_cast<std::size_t>(x)]);
  }
  return image;
}

ShownLights load_lights(const Scene& scene, int bands, std::vector<std::string>& notes) {
  const SceneDescription& description = scene.description;
  ShownLights lights{shown_light(scene.color, load_spectrum(description.light.spectrum), bands), {}};
  for (const LightSourceDescription& each : description.lights)
    if (each.kind == LightKind::environment)
      lights.environments.push_back(load_environment(each, scene.color, lights.light, notes));
  return lights;
}

std::vector<float> ShownLight::luminances() const {
  std::vector<float> luminances;
  for (const Band& band : bands) luminances.push_back(static_cast<float>(band.xyz.y()));
  return luminances;
}

std::vector<float> ShownLight::radiance(const Eigen::Vector3d& rec709, double factor) const {
  const ReflectanceSpectrum spectrum = model.spectrum(rec709_to_working * rec709);
  std::vector<float> values;
  for (const Band& band : bands) values.push_back(static_cast<float>(factor * spectrum.at(band.wavelength)));
  return values;
}

PathScene load_paths(const Scene& scene, const PathTracingDescription& settings, std::vector<std::string>& notes) {
  const SceneDescription& description = scene.description;
  PathScene paths{settings, {}, {}, load_lights(scene, settings.bands, notes)};
  if (!settings.paths.empty()) {
    paths.paths = read_paths(settings.paths);
    turn_paths(paths.paths, scene.description.turn());
  } else {
    try {
      paths.seeds =
          seeds_of(seed_list(scene, settings.seeds),
                   followed(scene.channels, description.bending.rgb.has_value(), settings.color.by), scene.beam);
    } catch (const std::invalid_argument& error) {
      throw SceneError(fmt::format("{}: `/integrator/seeds`: {}", description.path.string(), error.what()));
    }
  }
  return paths;
}

std::vector<Path> follow_paths(const Scene& scene, const PathScene& path_scene, bool tensors, Job* job,
                               const Progress& progress, Statistics& statistics) {
  const PathTracingDescription& description = path_scene.settings;
  PathSettings settings;
  settings.backwards = description.backwards;
  settings.outside = description.outside;
  settings.tensors = tensors;
  settings.job = job;
  std::vector<Path> paths = path_scene.seeds.empty() ? path_scene.paths
                                                     : trace_paths(scene.field, scene.geometry, scene.bending,
                                                                   path_scene.seeds, settings, progress);
  count_ends(scene, paths, statistics);
  paths.erase(std::remove_if(paths.begin(), paths.end(), [](const Path& path) { return path.points.size() < 2; }),
              paths.end());
  if (paths.empty())
    throw std::runtime_error(scene.description.path.string() +
                             ": no path meets the volume; look at `/integrator/seeds` and `/light/direction`");
  return paths;
}

}  // namespace tensorray
