#include <cmath>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "base/text/path_text.h"
#include "scenes/description/choices.h"
#include "scenes/scene/scene.h"
#include "scenes/scene/turning.h"
#include "volumes/files/tensor_files.h"
#include "volumes/making/field_making.h"
#include "volumes/making/noise.h"
#include "volumes/making/smoothing.h"

namespace tensorray {
namespace {

constexpr double erased = 0.5;  // Of a field's variation: less is left where smoothing erases structure.

BlockSource open_field(const SceneDescription& scene) {
  const FieldDescription& field = scene.field;
  if (!field.generate && has_number_sign(field.file.filename().string()) && !std::filesystem::exists(field.file))
    throw SceneError(field.file.string() + ": # is for the number of a frame: give --frames");
  if (!field.generate) {
    BlockSource blocks = open_tensor_vdb(field.file_to_read(), field.name, field.derive, field.components);
    return scene.world.up == UpAxis::z ? blocks : turned(std::move(blocks), scene.turn());
  }
  try {
    require_memory_for(field.generate->grid, 65);  // With the bricks.
    return generator_source(field.generate->generator, field.generate->grid);
  } catch (const std::invalid_argument& error) {
    throw SceneError(fmt::format("{}: `/field/generate`: {}", scene.path.string(), error.what()));
  }
}

/// What tells whether a file has the bytes that it had.
std::vector<long long> identity_of(const std::filesystem::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return {};
  return {static_cast<long long>(status.st_dev), static_cast<long long>(status.st_ino), status.st_size,
          status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

/// What names the field in notes and errors.
std::string source_of(const SceneDescription& scene) {
  const FieldDescription& field = scene.field;
  return field.generate ? kind_of(field.generate->generator) : field.file.string();
}

/// What the field is between its voxels, in words.
std::string between_voxels(const MadeField& made) {
  const Interpolant& interpolant = made.field->interpolant();
  if (interpolant.between == Interpolation::linear) return "linear between them";
  const bool is_dense = static_cast<double>(made.voxels) == (made.field->voxels().sizes().array() + 1).prod();
  if (is_dense) return "cubic between them";
  return interpolant.border == Border::fade ? "cubic between them, fading beside inactive ones"
                                            : "cubic between them, continued into inactive ones";
}

LoadedField with_notes(MadeField made, const std::string& source, FieldUnits units) {
  std::vector<std::string> notes;
  if (made.non_finite > 0)
    notes.push_back(fmt::format("warning: {}: {} of {} voxels are not finite; light goes straight there", source,
                                made.non_finite, made.voxels + made.non_finite));
  if (!made.field) throw std::runtime_error(source + ": no voxel of the field is finite; nothing can be traced");
  const EigenvalueReport& eigenvalues = made.eigenvalues;
  std::string voxels = fmt::format("{} voxels", made.voxels);
  if (!made.finer_voxels.empty()) voxels += fmt::format(", and in finer levels {}", fmt::join(made.finer_voxels, ", "));
  notes.push_back(fmt::format("field: {}, {}, eigenvalues {}, {}", source, voxels, choice_name(eigenvalues.chosen),
                              between_voxels(made)));
  if (const double beyond = made.field->surface_beyond(); beyond > 0)
    notes.push_back(fmt::format(
        "warning: {}: the surface of the field's body reaches {:.2g} voxels beyond the field; light is straight there; "
        "sample the field up to its surface",
        source, beyond));
  if (is_coarse(made.resolution))
    notes.push_back(fmt::format(
        "warning: {}: voxels are too coarse, or have noise: linear and cubic interpolation differ by {:.0f}% of the "
        "field's norm in one of 10 cells, {:.0f}% in one of 100; sample the field more finely, or smooth it{}",
        source, 100 * made.resolution.percentile_90, 100 * made.resolution.percentile_99,
        eigenvalues.chosen == Eigenvalues::absolute ? "; or the kinks are those of absolute eigenvalues, where they "
                                                      "change sign: \"eigenvalues\": \"raw\" has none"
                                                    : ""));
  if (eigenvalues.defective > 0)
    notes.push_back(fmt::format("{} voxels hold a defective tensor, preprocessed by its limit", eigenvalues.defective));
  if (eigenvalues.norm_lost > 0.01)
    notes.push_back(
        fmt::format("preprocessing erased {:.0f}% of the field's squared norm (rotation and shear); "
                    "\"eigenvalues\": \"raw\" keeps it",
                    100 * eigenvalues.norm_lost));
  return {std::move(*made.field), eigenvalues, made.non_finite, std::move(notes), std::move(units)};
}

/// @param metadata  Of a file: what an import writes (`--units`, lattice.h).
FieldUnits units_in(const std::map<std::string, std::string>& metadata) {
  const auto entry = [&](const char* key) {
    const auto found = metadata.find(key);
    return found == metadata.end() ? std::string() : found->second;
  };
  return {entry("tensorray:world_unit"), entry("tensorray:units"), entry("tensorray:world_axes") == "RAS"};
}

/// A tensor's unit "X/length" or "X/length^2" with the unit of lengths in place of that word, if it is known. A length
/// in X cancels: (m/s)/m is 1/s.
std::string with_length(const std::string& unit, const std::string& length) {
  const std::string word = "/length";
  const std::size_t at = unit.rfind(word);
  if (length.empty() || at == std::string::npos) return unit;
  const std::string of = unit.substr(0, at), power = unit.substr(at + word.size());
  if (!power.empty() && power != "^2") return unit;
  if (power.empty() && (of == length || of.rfind(length + "/", 0) == 0)) return "1" + of.substr(length.size());
  return of + "/" + length + power;
}

}  // namespace

FieldUnits units_of(const Scene& scene) {
  const SceneDescription& description = scene.description;
  FieldUnits units = scene.file_units;
  if (!description.world.unit.empty()) units.length = description.world.unit;
  units.tensor = with_length(units.tensor, units.length);
  if (!description.field.unit.empty()) units.tensor = description.field.unit;
  return units;
}

double metres_in(const std::string& unit) {
  static const std::map<std::string, double> units{{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3},   {"cm", 1e-2},
                                                   {"m", 1},     {"km", 1e3},  {"in", 0.0254}, {"ft", 0.3048}};
  const auto found = units.find(unit);
  return found == units.end() ? 1 : found->second;
}

FieldChoices choices_of(const SceneDescription& description) {
  const FieldDescription& field = description.field;
  const bool is_free = field.border == BorderChoice::automatic;
  const auto* word = std::get_if<BoundsChoice>(&field.bounds);
  const bool stops = !description.obstacles.empty() || !word;
  FieldChoices choices;
  choices.smoothing = field.smooth;
  choices.noise = field.noise;
  choices.eigenvalues = field.eigenvalues;
  const bool extends = is_free ? stops : field.border == BorderChoice::extend;
  choices.interpolant = {field.interpolation, extends ? Border::extend : Border::fade};
  choices.keeps_surface = !word || *word != BoundsChoice::none;
  choices.at_surface = is_free || extends ? Border::extend : Border::fade;
  return choices;
}

LoadedField prepare_field(const BlockSource& blocks, FieldChoices choices, const std::string& source) {
  if (!choices.keeps_surface && !blocks.surface.triangles.empty()) {
    BlockSource without = blocks;
    without.surface = {};
    return prepare_field(without, choices, source);
  }
  if (!blocks.surface.triangles.empty()) choices.interpolant.border = choices.at_surface;
  if (choices.smoothing == 0 && !choices.noise)
    return with_notes(make_field(blocks, choices.eigenvalues, choices.interpolant), source, units_in(blocks.metadata));
  TensorGrid grid = to_grid(blocks);
  const std::size_t non_finite = remove_non_finite(grid);
  if (choices.noise) keep_noise(grid);
  const double before = variation(grid);
  smooth(grid, choices.smoothing);
  const double kept = before > 0 ? variation(grid) / before : 1;
  MadeField made = make_field(source_of(std::move(grid)), choices.eigenvalues, choices.interpolant);
  made.non_finite += non_finite;
  if (choices.noise) made.resolution = {};  // Noise is never resolved.
  LoadedField loaded = with_notes(std::move(made), source, units_in(blocks.metadata));
  if (choices.noise) loaded.notes.push_back("field: its noise alone, in random order, and no structure");
  if (choices.smoothing > 0)
    loaded.notes.push_back(
        fmt::format("{}field smoothed: a Gaussian of {:g} voxels leaves {:.0f}% of its variation{}",
                    kept < erased && !choices.noise ? "warning: " : "", choices.smoothing, 100 * kept,
                    kept < erased && !choices.noise ? "; if that was no noise, smooth it less" : ""));
  return loaded;
}

std::string field_key(const SceneDescription& description) {
  nlohmann::json field = nlohmann::json::parse(description.text).at("field");
  if (field.is_object()) {
    field.erase("scale");
    field.erase("bounds");
  }
  const FieldChoices choices = choices_of(description);
  return nlohmann::json{field,
                        description.world.up,
                        identity_of(description.field.file_to_read()),
                        choices.interpolant.between,
                        choices.interpolant.border,
                        choices.keeps_surface,
                        choices.eigenvalues}
      .dump();
}

std::optional<LoadedField> field_of(const std::optional<Scene>& before, const SceneDescription& description) {
  if (!before || before->field_key != field_key(description)) return {};
  LoadedField field{before->field, before->eigenvalues, before->non_finite, {}, before->file_units};
  field.is_known = true;
  field.kept = before->kept;
  return field;
}

LoadedField load_field(const SceneDescription& scene, const Progress& progress) {
  const std::string key = field_key(scene) + fmt::format("{}", fmt::join(identity_of("/proc/self/exe"), " "));
  return share_field(
      key, [&] { return prepare_field(open_field(scene), choices_of(scene), source_of(scene)); }, progress);
}

}  // namespace tensorray
