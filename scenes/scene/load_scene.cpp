#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/process/seconds.h"
#include "renderer/meshes/mesh.h"
#include "scenes/description/choices.h"
#include "scenes/scene/scene.h"
#include "scenes/scene/turning.h"

namespace tensorray {
namespace {

constexpr double dark_margin = 1.25;       // Size of the plate, in extents of a beam that does not fill it.
constexpr double default_distance = 0.25;  // Distance of the plate behind the volume, in depths of the volume.
constexpr double max_size = 1e5;  // Largest size of the scene, in sizes of the volume: Embree is single precision.
constexpr double narrowest_white = 100;   // nm: light of a narrower range has no white.
constexpr double max_stretch = 1.05;      // Pixels' longer side over the shorter one.
constexpr int default_resolution = 512;   // Pixels along the plate's longer side.
constexpr int least_resolution = 128;     // Pixels along its shorter side, if those along the longer one ...
constexpr int most_resolution = 2048;     // ... are not more than this.
constexpr double narrowest_plate = 0.25;  // Its shorter side, as a part of the longer one, where the size is not given.
constexpr double visible = 0.02;          // AutoScale::shown; a picture that shows less looks empty.
constexpr double much_less = 0.5;         // Of the best AutoScale::shown: reason to name that scale.
constexpr double huge = 1e4;              // The greatest exponent s · scale · T · way of a scale that is not.
constexpr double much = 1;                // AutoScale::median_turn, radians.

TriangleMesh load_closed_mesh(const SceneDescription& scene, const std::filesystem::path& path) {
  TriangleMesh mesh = read_mesh(path, scene.turn());
  try {
    require_closed(mesh);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
  return mesh;
}

/// The primaries of linear Rec. 709 as three bands of light, so that RGB mode needs no separate code for colours.
std::vector<Band> rgb_bands() {
  const Eigen::Matrix3d xyz = rec709_to_xyz();
  std::vector<Band> bands(3);
  for (int i = 0; i < 3; ++i) bands[i] = {0, 0, 1.0 / 3, xyz.col(i)};
  return bands;
}

std::vector<Band> bands_of(const Spectrum& spectrum, const SceneDescription& description) {
  if (description.bending.rgb) return rgb_bands();
  const LightDescription& light = description.light;
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

/// Moves the start of the beam back, so that it is also before all `points`.
void start_before(Beam& beam, const std::vector<Eigen::Vector3d>& points) {
  double before = 0;
  for (const Eigen::Vector3d& point : points) before = std::min(before, (point - beam.center).dot(beam.direction));
  beam.center += 1.01 * before * beam.direction;
}

/// The beam of the given aperture; without one, that of the volume's silhouette.
Beam make_beam(const SceneDescription& description, const TensorField& field) {
  const LightDescription& light = description.light;
  const Eigen::Vector3d up = light.up.value_or(Eigen::Vector3d::UnitZ());
  Beam beam = silhouette_beam(field.corners(), *light.direction, up);
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

/// Size of the smallest rectangle about the plate's centre, along its right and up axes, that contains the straight
/// projection of the aperture's corners along the light onto the plate.
Eigen::Vector2d lit_extent(const Plate& plate, const Beam& beam) {
  Eigen::Vector2d half(0, 0);
  for (const Eigen::Vector2d& corner : beam.aperture) {
    const Eigen::Vector3d origin = beam.start(corner) - plate.center;
    const Eigen::Vector3d landing =
        origin - origin.dot(plate.normal()) / beam.direction.dot(plate.normal()) * beam.direction;
    half = half.cwiseMax(Eigen::Vector2d(landing.dot(plate.right), landing.dot(plate.up)).cwiseAbs());
  }
  return 2 * half;
}

Plate make_plate(const SceneDescription& description, const TensorField& field, const Beam& beam) {
  const ReceiverDescription& receiver = description.receiver;
  const auto [near, far] = depth_range(field, beam.center, beam.direction);
  Plate plate;
  const double distance = receiver.distance.value_or(default_distance * (far - near));
  plate.center = receiver.center.value_or(beam.center + (far + distance) * beam.direction);
  Eigen::Vector3d normal = receiver.normal.value_or(-beam.direction).normalized();
  // The given normal may point to either side. The plate is seen along the light.
  if (normal.dot(beam.direction) > 0) normal = -normal;
  plate.up = upright(normal, receiver.up.value_or(beam.up));
  plate.right = plate.up.cross(normal);
  plate.size = receiver.size.value_or((description.light.fills_plate() ? 1 : dark_margin) * lit_extent(plate, beam));
  if (!receiver.size) plate.size = plate.size.cwiseMax(narrowest_plate * plate.size.maxCoeff());
  if (!(plate.size.minCoeff() > 0) || !plate.size.allFinite())
    throw SceneError(description.path.string() +
                     ": `/receiver`: no light falls on the plate; give its `size` and `center`");
  const double longer = std::clamp(least_resolution * plate.size.maxCoeff() / plate.size.minCoeff(),
                                   double{default_resolution}, double{most_resolution});
  const Eigen::Vector2d pixels = longer * plate.size / plate.size.maxCoeff();
  plate.resolution = receiver.resolution.value_or(pixels.array().round().max(1).cast<int>().matrix());
  return plate;
}

/// Where the scene's pixels are no squares, the picture is stretched: says which numbers make squares.
void note_pixels(const ReceiverDescription& receiver, const Plate& plate, std::vector<std::string>& notes) {
  if (!receiver.resolution) return;
  const Eigen::Vector2d pixel = plate.size.cwiseQuotient(plate.resolution.cast<double>());
  if (pixel.maxCoeff() < max_stretch * pixel.minCoeff()) return;
  const Eigen::Vector2i square =
      (plate.resolution.maxCoeff() * plate.size / plate.size.maxCoeff()).array().round().max(1).cast<int>();
  notes.push_back(
      fmt::format("warning: the picture is stretched, as pixels of the plate are {:.2g} times as {} as {}; [{}, {}] "
                  "pixels are squares",
                  pixel.maxCoeff() / pixel.minCoeff(), pixel.x() > pixel.y() ? "wide" : "high",
                  pixel.x() > pixel.y() ? "high" : "wide", square.x(), square.y()));
}

/// Where light falls on the plate before it has crossed the volume, the picture does not show what is behind.
void note_place(const Plate& plate, const TensorField& field, std::vector<std::string>& notes) {
  const auto [nearest, farthest] = depth_range(field, plate.center, -plate.normal());  // The plate faces the light.
  if (farthest > 1e-6 * (farthest - nearest))
    notes.push_back(
        fmt::format("warning: the plate lies {} the volume as the light sees it, so that light falls on it "
                    "before the field has acted on it; move `receiver.center` along the light, or leave it out",
                    nearest < 0 ? "in" : "before"));
}

[[noreturn]] void fail_size(const SceneDescription& description, const char* pointer) {
  throw SceneError(
      fmt::format("{}: `{}` is too large or too far away: more than {:g} times the volume's size; make it smaller or "
                  "move it nearer",
                  description.path.string(), pointer, max_size));
}

double max_distance(const TensorField& field) { return max_size * field.world_box().diagonal().norm(); }

void require_near(const Beam& beam, const SceneDescription& description, const TensorField& field) {
  for (const Eigen::Vector2d& corner : beam.aperture)
    if (!(corner.norm() < max_distance(field))) fail_size(description, "/light/aperture");
}

/// Whether light bends only within the surface of the field's body.
bool ends_at_surface(const SceneDescription& description, const TensorField& field) {
  const auto* word = std::get_if<BoundsChoice>(&description.field.bounds);
  return word && *word == BoundsChoice::automatic && !field.surface().triangles.empty();
}

/// Loads the bounds of the field and its cut.
Surfaces load_volume(const SceneDescription& description, const TensorField& field) {
  Surfaces surfaces;
  surfaces.bounds = box_mesh(field.index_bounds(), field.to_world());
  if (const auto* mesh = std::get_if<std::filesystem::path>(&description.field.bounds))
    surfaces.cut = load_closed_mesh(description, *mesh);
  else if (ends_at_surface(description, field))
    surfaces.cut = closed_surface(field.surface(), description.field.file.string());
  return surfaces;
}

/// Loads the volume, the obstacles and the plate. Moves the start of `beam` before all of them.
Surfaces load_surfaces(const SceneDescription& description, const TensorField& field, Beam& beam) {
  Surfaces surfaces = load_volume(description, field);
  for (const std::filesystem::path& path : description.obstacles)
    surfaces.obstacles.push_back(read_mesh(path, description.turn()));
  surfaces.plate = make_plate(description, field, beam);
  require_near(beam, description, field);
  require_near(*surfaces.plate, "/receiver", description, field);
  for (const TriangleMesh& mesh : surfaces.obstacles) start_before(beam, mesh.vertices);
  start_before(beam, surfaces.plate->corners());
  return surfaces;
}

/// What to do about a given scale that shows hardly anything, or is huge; empty: it shows enough, or no other one
/// would.
std::string advice_on(const AutoScale& given, const AutoScale& best, bool is_huge) {
  const bool is_seen = given.shown >= much_less * best.shown, is_tangled = given.median_turn > best.median_turn;
  if (best.shown == 0 || (is_seen && !is_huge)) return "";
  return fmt::format("warning: {}: `field.scale` {:.3g} shows {:.0f}% of the field, {:.3g} shows {:.2g}%",
                     is_seen      ? "the scale is huge, and light takes very many steps"
                     : is_tangled ? "light is tangled"
                                  : "light turns too little to be seen",
                     best.scale, 100 * best.shown, given.scale, 100 * given.shown);
}

/// The scale that shows the field to its light; if its picture looks through the field in another direction, the mean
/// of the scales for both.
AutoScale scale_for(const SceneDescription& description, const TensorField& field, const Geometry& volume,
                    const Beam& light, const Progress& progress) {
  const AutoScale scale = choose_scale(field, volume, light, progress);
  const auto view = description.integrator.method().view_through(description, field.world_box().center());
  if (!view || view->norm() == 0) return scale;
  const AutoScale by_view = choose_scale(field, volume, silhouette_beam(field.corners(), *view, light.up), progress);
  if (by_view.shown == 0) return scale;
  const double mean = scale.shown > 0 ? std::sqrt(scale.scale * by_view.scale) : by_view.scale;
  return judge_scale(field, volume, light, mean, probe_flexibility, progress);
}

/// The scale of the scene; without one, a scale that bends light visibly. The choice ignores obstacles and aperture, so
/// that pictures with and without them can be compared. @param flexibility  Of light in the middle of the spectrum, or
/// of the colour that bends most.
AutoScale load_scale(const SceneDescription& description, const TensorField& field, const Geometry& geometry,
                     const Beam& beam, double flexibility, const Progress& progress, std::vector<std::string>& notes) {
  const std::optional<double>& given = description.field.scale;
  if (!description.integrator.method().bends_light() ||
      (given && (!description.judges_scale || description.field.noise || flexibility == 0)))
    return AutoScale{given.value_or(1)};
  const Geometry volume({geometry.surfaces().bounds, geometry.surfaces().cut, std::nullopt, {}});
  const Beam light = silhouette_beam(field.corners(), beam.direction, beam.up);
  const AutoScale scale = given ? judge_scale(field, volume, light, *given, flexibility, progress)
                                : scale_for(description, field, volume, light, progress);
  const double depth = (field.to_world().linear() * field.index_bounds().sizes()).norm();
  const bool is_huge = std::abs(scale.scale * flexibility) * field.max_norm() * depth > huge;
  std::string advice;
  if (given && (scale.shown < visible || scale.median_turn > much || is_huge) &&
      description.integrator.method().needs_light_direction(description)) {
    AutoScale best = scale_for(description, field, volume, light, progress);
    best.scale *= probe_flexibility / std::abs(flexibility);
    advice = advice_on(scale, best, is_huge);
  }
  if (scale.greatest_turn == 0 && advice.empty()) {
    notes.push_back(
        fmt::format("warning: no probe ray is turned (the field is zero or isotropic, or light travels along its "
                    "eigenvectors, or misses the volume); scale {:g}",
                    scale.scale));
    return scale;
  }
  notes.push_back(fmt::format(
      "scale: {:.6g}{} (at s = {:.3g} the median ray turns by {:.3f} rad, the one that turns most by {:.3f}; shown: "
      "{:.0f}%)",
      scale.scale, scale.scale < 0 ? ", negative: light bends the other way," : "", given ? flexibility : 0.2,
      scale.median_turn, scale.greatest_turn, 100 * scale.shown));
  if (!advice.empty()) notes.push_back(advice);
  return scale;
}

/// A direction in the axes of the scene's file, without -0.
Eigen::Vector3d shown(const SceneDescription& description, const Eigen::Vector3d& direction) {
  return description.turn().transpose() * direction + Eigen::Vector3d::Zero();
}

/// The direction of the light, if the scene leaves it open. The choice ignores obstacles, too.
Eigen::Vector3d load_direction(const SceneDescription& description, const TensorField& field, const Progress& progress,
                               std::vector<std::string>& notes) {
  if (description.light.direction) return *description.light.direction;
  if (!description.integrator.method().bends_light()) {
    const Eigen::Vector3d sizes = field.world_box().sizes();
    int shortest = 2;  // Also of a cube.
    for (const int axis : {1, 0})
      if (sizes[axis] < (1 - 1e-6) * sizes[shortest]) shortest = axis;
    const Eigen::Vector3d V = -Eigen::Vector3d::Unit(shortest) + Eigen::Vector3d::Zero();
    notes.push_back(
        fmt::format("light: along [{:g}], where the field is thinnest", fmt::join(shown(description, V), ", ")));
    return V;
  }
  const AutoDirection chosen = choose_direction(field, Geometry(load_volume(description, field)),
                                                description.light.up.value_or(Eigen::Vector3d::UnitZ()), progress);
  const Eigen::Vector3d V = chosen.direction + Eigen::Vector3d::Zero();  // 0, not -0.
  if (description.integrator.method().needs_light_direction(description))
    notes.push_back(fmt::format("light: along [{:.3g}], where it shows most of 26 directions",
                                fmt::join(shown(description, V), ", ")));
  return V;
}

/// The light of a scene, and how its colours are shown.
struct LoadedLight {
  ColorManagement color;
  Spectrum spectrum;
  std::vector<Band> bands;
};

LoadedLight load_light(const SceneDescription& description) {
  const OutputDescription& output = description.output;
  LoadedLight light{ColorManagement({output.ocio, output.display, output.view}), {}, {}};
  if (!description.bending.rgb) light.spectrum = load_spectrum(description.light.spectrum);
  light.bands = bands_of(light.spectrum, description);
  return light;
}

/// The first notes of a scene: what its description and its field have to say.
std::vector<std::string> notes_of(const SceneDescription& description, const LoadedField& field) {
  std::vector<std::string> notes;
  for (const std::string& warning : description.warnings) notes.push_back("warning: " + warning);
  notes.insert(notes.end(), field.notes.begin(), field.notes.end());
  return notes;
}

Scene make_scene(SceneDescription description, LoadedLight light, LoadedField loaded, std::vector<std::string> notes,
                 const Progress& progress) {
  if (!loaded.is_known && ends_at_surface(description, loaded.field))
    notes.push_back(fmt::format("body: surface of {} triangles", loaded.field.surface().triangles.size()));
  description.light.direction = load_direction(description, loaded.field, progress, notes);
  Beam beam = make_beam(description, loaded.field);
  Geometry geometry(load_surfaces(description, loaded.field, beam));
  note_pixels(description.receiver, *geometry.surfaces().plate, notes);
  if (description.receiver.center && description.integrator.method().shows_plate())
    note_place(*geometry.surfaces().plate, loaded.field, notes);
  Scene scene(description, std::move(loaded.field), std::move(geometry), std::move(light.color));
  scene.kept = std::move(loaded.kept);
  scene.file_units = std::move(loaded.units);
  scene.eigenvalues = loaded.eigenvalues;
  scene.non_finite = loaded.non_finite;
  scene.beam = std::move(beam);
  scene.channels = channels_of(light.bands, description.bending);
  scene.spectrum = std::move(light.spectrum);
  scene.bands = std::move(light.bands);
  double flexibility = scene.channels[scene.channels.size() / 2].flexibility;
  if (description.bending.rgb) flexibility = description.bending.rgb->cwiseAbs().maxCoeff();
  scene.scale = load_scale(description, scene.field, scene.geometry, scene.beam, flexibility, progress, notes);
  scene.bending = description.bending.settings;
  scene.bending.scale = scene.scale.scale;
  scene.method = description.integrator.method().load(scene, notes);
  scene.notes = std::move(notes);
  return scene;
}

}  // namespace

TriangleMesh closed_surface(TriangleMesh surface, const std::string& source) {
  try {
    require_closed(surface);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format(
        "{}: the surface of the field's body: {}; `field.bounds: \"none\"` ignores it, a closed mesh replaces it",
        source, error.what()));
  }
  return surface;
}

void require_near(const Plate& plate, const char* pointer, const SceneDescription& description,
                  const TensorField& field) {
  const Eigen::Vector3d middle = field.to_world() * field.index_bounds().center();
  if (!(plate.size.maxCoeff() < max_distance(field) && (plate.center - middle).norm() < max_distance(field)))
    fail_size(description, pointer);
}

Scene load_scene(SceneDescription description, const Progress& progress, std::optional<LoadedField> field) {
  const auto start = Clock::now();
  const std::string key = field_key(description);  // Of the file as it is now.
  LoadedLight light = load_light(description);
  if (!field) {
    progress.update("loading", 0, 1);
    field = load_field(description, progress);
  }
  std::vector<std::string> notes;
  if (!field->is_known) notes = notes_of(description, *field);
  Scene scene = make_scene(std::move(description), std::move(light), *std::move(field), std::move(notes), progress);
  scene.field_key = key;
  scene.seconds = seconds_since(start);
  return scene;
}

bool has_white(const Scene& scene) {
  double width = 0;
  for (const Band& band : scene.bands) width += band.width;
  return scene.description.bending.rgb || width >= narrowest_white;
}

Eigen::Matrix3d to_working(const Scene& scene) {
  if (!scene.description.output.white_balance || !has_white(scene)) return scene.color.xyz_to_working();
  Eigen::Vector3d white = Eigen::Vector3d::Zero();
  for (const Band& band : scene.bands) white += band.xyz;
  return scene.color.xyz_to_working_adapted(white);
}

}  // namespace tensorray
