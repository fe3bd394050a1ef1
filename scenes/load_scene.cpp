#include "scenes/load_scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

#include <fmt/format.h>

#include "renderer/surfaces/mesh.h"
#include "scenes/choices.h"
#include "scenes/read_scene.h"
#include "volumes/files/tensor_files.h"

namespace tensorray {
namespace {

constexpr double default_margin = 1.25;    // Of the plate about the beam.
constexpr double default_distance = 0.25;  // Of the plate behind the volume, in depths of the volume.
constexpr double greatest_size = 1e5;      // Of the scene, in sizes of the volume: Embree is single precision.
constexpr std::size_t exact_bands = 10;    // With so many a reflectance can have any colour of Rec.709.
constexpr int default_resolution = 512;    // Of the plate's longer side.

TensorGrid load_grid(const SceneDescription& scene) {
  const FieldDescription& field = scene.field;
  if (!field.generate) return read_tensor_vdb(field.file, field.name, field.derive);
  try {
    return generate(field.generate->generator, field.generate->grid);
  } catch (const std::invalid_argument& error) {
    throw SceneError(fmt::format("{}: `/field/generate`: {}", scene.path.string(), error.what()));
  }
}

std::string source_of(const FieldDescription& field) {
  return field.generate ? kind_of(field.generate->generator) : field.file.string();
}

/// Reads or makes the field, without what is not finite, preprocessed.
TensorField load_field(const SceneDescription& description, EigenvalueReport& eigenvalues, std::size_t& non_finite,
                       std::vector<std::string>& notes) {
  TensorGrid grid = load_grid(description);
  const std::size_t active = grid.active_voxels();
  non_finite = remove_non_finite(grid);
  const std::string source = source_of(description.field);
  if (non_finite > 0)
    notes.push_back(fmt::format("warning: {}: {} of {} voxels are not finite; light goes straight there", source,
                                non_finite, active));
  if (grid.blocks.empty())
    throw std::runtime_error(source + ": no voxel of the field is finite; nothing can be traced");
  eigenvalues = apply_eigenvalues(grid, description.field.eigenvalues);
  notes.push_back(fmt::format("field: {}, {} voxels, eigenvalues {}", source, grid.active_voxels(),
                              choice_name(eigenvalues.chosen)));
  if (eigenvalues.defective > 0)
    notes.push_back(fmt::format("{} voxels hold a defective tensor, preprocessed by its limit", eigenvalues.defective));
  if (eigenvalues.norm_lost > 0.01)
    notes.push_back(
        fmt::format("preprocessing erased {:.0f}% of the field's squared norm (rotation and shear); "
                    "\"eigenvalues\": \"raw\" keeps it",
                    100 * eigenvalues.norm_lost));
  return TensorField(std::move(grid));
}

TriangleMesh load_closed_mesh(const std::filesystem::path& path) {
  TriangleMesh mesh = read_mesh(path);
  try {
    require_closed(mesh);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
  return mesh;
}

Spectrum load_spectrum(const std::string& name) {
  const std::vector<std::string> known = illuminant_names();
  if (std::find(known.begin(), known.end(), name) != known.end()) return illuminant(name);
  std::istringstream words(name);
  std::string word;
  double kelvin = 0;
  if (words >> word >> kelvin && word == "blackbody") return blackbody(kelvin);
  return read_spectrum(name);
}

/// The primaries of linear Rec. 709 as three bands of light, so that RGB mode needs no colour path of its own.
std::vector<Band> rgb_bands() {
  const Eigen::Matrix3d xyz = rec709_to_xyz();
  std::vector<Band> bands(3);
  for (int i = 0; i < 3; ++i) bands[i] = {0, 0, 1.0 / 3, xyz.col(i)};
  return bands;
}

std::vector<Band> load_bands(const SceneDescription& description) {
  if (description.bending.rgb) return rgb_bands();
  const LightDescription& light = description.light;
  const Spectrum spectrum = load_spectrum(light.spectrum);
  try {
    return make_bands(spectrum, light.wavelength_min, light.wavelength_max, light.wavelength_count);
  } catch (const std::invalid_argument& error) {
    throw SceneError(fmt::format("{}: `/light/wavelengths`: {}", description.path.string(), error.what()));
  }
}

std::vector<LightChannel> channels_of(const std::vector<Band>& bands, const BendingDescription& bending) {
  std::vector<LightChannel> channels;
  for (std::size_t i = 0; i < bands.size(); ++i)
    channels.push_back({bending.rgb ? (*bending.rgb)[static_cast<int>(i)] : bending.flexibility.at(bands[i].wavelength),
                        bands[i].wavelength, bands[i].power});
  return channels;
}

std::vector<Eigen::Vector2d> rectangle(const Eigen::Vector2d& center, const Eigen::Vector2d& size) {
  const Eigen::Vector2d x(size.x() / 2, 0), y(0, size.y() / 2);
  return {center - x - y, center + x - y, center + x + y, center - x + y};
}

/// Moves the start of the beam so that it is before the points, too.
void start_before(Beam& beam, const std::vector<Eigen::Vector3d>& points) {
  double before = 0;
  for (const Eigen::Vector3d& point : points) before = std::min(before, (point - beam.center).dot(beam.direction));
  beam.center += 1.01 * before * beam.direction;
}

/// The silhouette's beam, or that of the given aperture.
Beam make_beam(const SceneDescription& description, const TensorField& field) {
  const LightDescription& light = description.light;
  const Eigen::Vector3d up = light.up.value_or(Eigen::Vector3d::UnitZ());
  Beam beam = silhouette_beam(field.corners(), light.direction, up);
  if (light.aperture) {
    Eigen::Vector2d center(0, 0);
    if (light.aperture->center) {
      const Eigen::Vector3d offset = *light.aperture->center - beam.center;
      center = {offset.dot(beam.right), offset.dot(beam.up)};
    }
    beam.aperture = rectangle(center, light.aperture->size);
  }
  return beam;
}

/// Where light that goes straight on through the aperture's corners meets the plate, from its centre along right, up.
Eigen::Vector2d lit_extent(const Plate& plate, const Beam& beam) {
  Eigen::Vector2d half(0, 0);
  for (const Eigen::Vector2d& corner : beam.aperture) {
    const Eigen::Vector3d origin = beam.center + corner.x() * beam.right + corner.y() * beam.up - plate.center;
    const Eigen::Vector3d landing =
        origin - origin.dot(plate.normal()) / beam.direction.dot(plate.normal()) * beam.direction;
    half = half.cwiseMax(Eigen::Vector2d(landing.dot(plate.right), landing.dot(plate.up)).cwiseAbs());
  }
  return 2 * half;
}

Plate make_plate(const SceneDescription& description, const TensorField& field, const Beam& beam) {
  const ReceiverDescription& receiver = description.receiver;
  double near = std::numeric_limits<double>::infinity(), far = -near;
  for (const Eigen::Vector3d& corner : field.corners()) {
    near = std::min(near, (corner - beam.center).dot(beam.direction));
    far = std::max(far, (corner - beam.center).dot(beam.direction));
  }
  Plate plate;
  const double distance = receiver.distance.value_or(default_distance * (far - near));
  plate.center = receiver.center.value_or(beam.center + (far + distance) * beam.direction);
  Eigen::Vector3d normal = receiver.normal.value_or(-beam.direction).normalized();
  if (normal.dot(beam.direction) > 0) normal = -normal;  // Seen along the light, whichever side it was given by.
  plate.up = upright(normal, receiver.up.value_or(beam.up));
  plate.right = plate.up.cross(normal);
  plate.size = receiver.size ? *receiver.size : Eigen::Vector2d(default_margin * lit_extent(plate, beam));
  if (!(plate.size.minCoeff() > 0) || !plate.size.allFinite())
    throw SceneError(description.path.string() +
                     ": `/receiver`: no light falls on the plate; give its `size` and `center`");
  const Eigen::Vector2d pixels = default_resolution * plate.size / plate.size.maxCoeff();
  plate.resolution = receiver.resolution.value_or(pixels.array().round().max(1).cast<int>().matrix());
  return plate;
}

[[noreturn]] void fail_size(const SceneDescription& description, const char* pointer) {
  throw SceneError(fmt::format("{}: `{}` lies, or reaches, more than {:g} times the volume's size away from it",
                               description.path.string(), pointer, greatest_size));
}

/// Refuses a plate so large, or so far away, that single precision would not find it.
void check_size(const SceneDescription& description, const TensorField& field, const Plate& plate,
                const char* pointer) {
  Eigen::AlignedBox3d volume;
  for (const Eigen::Vector3d& corner : field.corners()) volume.extend(corner);
  const double limit = greatest_size * volume.diagonal().norm();
  if (!(plate.size.maxCoeff() < limit && (plate.center - volume.center()).norm() < limit))
    fail_size(description, pointer);
}

/// The same of the beam.
void check_size(const SceneDescription& description, const TensorField& field, const Beam& beam) {
  Eigen::AlignedBox3d volume;
  for (const Eigen::Vector3d& corner : field.corners()) volume.extend(corner);
  for (const Eigen::Vector2d& corner : beam.aperture)
    if (!(corner.norm() < greatest_size * volume.diagonal().norm())) fail_size(description, "/light/aperture");
}

}  // namespace

Scene load_scene(const SceneDescription& description, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::string> notes;
  for (const std::string& warning : description.warnings) notes.push_back("warning: " + warning);
  ColorManagement color({description.output.ocio, description.output.display, description.output.view});
  std::vector<Band> bands = load_bands(description);
  std::vector<LightChannel> channels = channels_of(bands, description.bending);

  EigenvalueReport eigenvalues;
  std::size_t non_finite = 0;
  progress.update("loading", 0, 1);
  TensorField field = load_field(description, eigenvalues, non_finite, notes);

  Surfaces surfaces;
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  if (!description.field.bounds.empty()) surfaces.cut = load_closed_mesh(description.field.bounds);
  for (const std::filesystem::path& path : description.obstacles) surfaces.obstacles.push_back(read_mesh(path));
  Beam beam = make_beam(description, field);
  surfaces.plate = make_plate(description, field, beam);
  check_size(description, field, beam);
  check_size(description, field, *surfaces.plate, "/receiver");
  for (const TriangleMesh& mesh : surfaces.obstacles) start_before(beam, mesh.vertices);
  start_before(beam, surfaces.plate->corners());
  std::optional<LensScene> lens;
  if (description.integrator.type == IntegratorType::lens) {
    lens.emplace(load_lens(description, field, color, beam.direction, *surfaces.plate));
    if (!description.bending.rgb && bands.size() > 1 && bands.size() < exact_bands)
      notes.push_back(
          fmt::format("warning: with {} wavelengths saturated colours of the image may come out wrong; {} are "
                      "enough",
                      bands.size(), exact_bands));
    for (const Plate& plane : lens->planes) check_size(description, field, plane, "/integrator/image_plane");
  }
  Geometry geometry(std::move(surfaces));

  const bool automatic = !description.field.scale;
  // Of the field alone, so that pictures with and without obstacles or aperture can be compared.
  const Beam silhouette = silhouette_beam(field.corners(), beam.direction, beam.up);
  const Geometry probed({geometry.surfaces().bounds, geometry.surfaces().cut, std::nullopt, {}});
  const AutoScale scale =
      automatic ? choose_scale(field, probed, silhouette, progress) : AutoScale{*description.field.scale, 0, 0};
  if (automatic && scale.median_turn == 0)
    notes.push_back(
        "warning: no probe ray is turned (the field is zero or isotropic, or light travels along its "
        "eigenvectors, or misses the volume); scale 1");
  else if (automatic)
    notes.push_back(
        fmt::format("scale: {:.6g} (at s = 0.2 the median ray turns by {:.3f} rad)", scale.scale, scale.median_turn));
  BendingSettings bending = description.bending.settings;
  bending.scale = scale.scale;

  Scene scene{description,      std::move(field),    bending,          std::move(geometry),
              std::move(beam),  std::move(color),    std::move(lens),  std::nullopt,
              std::move(bands), std::move(channels), eigenvalues,      scale,
              automatic,        non_finite,          std::move(notes), 0};
  if (description.integrator.type == IntegratorType::path_tracing)
    scene.paths.emplace(load_paths(description, scene.field, scene.color, load_spectrum(description.light.spectrum),
                                   scene.channels, scene.beam));
  scene.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return scene;
}

}  // namespace tensorray
