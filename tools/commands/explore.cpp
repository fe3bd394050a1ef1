#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/files/output_file.h"
#include "base/text/text.h"
#include "integrators/methods/read_scene.h"
#include "renderer/charts/lettering.h"
#include "renderer/images/image.h"
#include "scenes/description/check_scene.h"
#include "scenes/keys/json_reader.h"
#include "scenes/outputs/picture_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tools/command_line/imported_field.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/commands/commands.h"
#include "tracing/scale/auto_scale.h"

namespace tensorray {
namespace {

constexpr std::array<double, 3> factors{0.5, 1, 2};  // Of the strength; one row each.
/// Small pictures of photons: quick, however chaotic the light is.
const std::vector<std::string> quick{"integrator.density={\"kind\":\"gaussian\",\"tau\":1}",
                                     "light.wavelengths.count=16", "light.wavelengths.per_photon=4"};
constexpr std::size_t quick_in_one_color = 1;  // The first of them.
constexpr double photons_per_pixel = 2.5;      // Undisturbed light then has 2% of noise.
constexpr int gap = 8;                         // Pixels about the pictures.

constexpr std::size_t columns = 6;  // Directions of the light.

struct ExploreOptions {
  std::vector<std::filesystem::path> files;
  std::filesystem::path imported;  // The field that is made of the files, if they have to be imported.
  ImportChoices import;
  std::vector<std::string> overrides;
  std::string sheet, scene_copy;
  std::optional<int> pick;
  int size = 200;
  unsigned threads = 0;
  bool quiet = false;
};

/// The picture with sides of at most `size` pixels: each is the mean of some of the picture's, if it is larger.
Image fitted(const Image& picture, int size) {
  const int step = (std::max(picture.width, picture.height) + size - 1) / size;
  if (step <= 1) return picture;
  Image result(std::max(1, picture.width / step), std::max(1, picture.height / step), {"R", "G", "B"});
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int i = 0; i < step * step; ++i)
        sum += Eigen::Map<const Eigen::Vector3f>(picture.pixel(std::min(x * step + i % step, picture.width - 1),
                                                               std::min(y * step + i / step, picture.height - 1)));
      Eigen::Map<Eigen::Vector3f>(result.pixel(x, y)) = sum / static_cast<float>(step * step);
    }
  return result;
}

/// The pictures of the sheet, and its labels.
class Sheet {
 public:
  explicit Sheet(int size)
      : size_(size),
        letters_(std::max(6.0, size / 20.0)),
        row_(size + static_cast<int>(2 * letters_) + gap),
        image_(static_cast<int>(columns) * (size + gap) + gap, static_cast<int>(factors.size()) * row_ + gap,
               {"R", "G", "B"}) {
    std::fill(image_.pixels.begin(), image_.pixels.end(), 0.15f);
  }

  void draw(std::size_t column, std::size_t row, const Image& rendered, const std::string& label) {
    const Image picture = fitted(rendered, size_);
    const int left = gap + static_cast<int>(column) * (size_ + gap), top = gap + static_cast<int>(row) * row_;
    const int x0 = left + (size_ - picture.width) / 2, y0 = top + (size_ - picture.height) / 2;
    for (int y = 0; y < size_; ++y)
      for (int x = 0; x < size_; ++x) std::fill_n(image_.pixel(left + x, top + y), 3, 0.0f);
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) std::copy_n(picture.pixel(x, y), 3, image_.pixel(x0 + x, y0 + y));
    const double height = letters_ * std::min(1.0, size_ / text_width(label, letters_));
    draw_text(image_, Eigen::Vector2d(left, top + size_ + 1.5 * letters_), height, label, {0.9, 0.9, 0.9});
  }

  const Image& image() const { return image_; }

 private:
  int size_;
  double letters_;  // Height, pixels.
  int row_;         // Height with the label.
  Image image_;
};

/// What all cells have in common. Keys that place things in one direction of light do not fit another.
std::vector<std::string> common_changes(const ExploreOptions& options) {
  std::vector<std::string> changes = options.overrides;
  for (const char* key : {"light.up", "light.aperture", "receiver.center", "receiver.normal", "receiver.up",
                          "receiver.size", "receiver.resolution"})
    changes.push_back(std::string(key) + "=null");
  return changes;
}

SceneDescription with(const ExploreOptions& options, const std::vector<std::string>& more) {
  SceneChanges changes{common_changes(options), {}};
  changes.overrides.insert(changes.overrides.end(), more.begin(), more.end());
  changes.imported = options.imported;
  return read_scene(options.files.front(), changes);
}

/// Pixels of a picture that fits into a cell.
std::string pixels_of(const Plate& plate, int size) {
  const Eigen::Vector2i pixels =
      (size * plate.size / plate.size.maxCoeff()).array().round().max(1).matrix().cast<int>();
  return fmt::format("receiver.resolution=[{},{}]", pixels.x(), pixels.y());
}

/// The directions that show most, those that show more first. Of light that is not bent, the axes.
std::vector<Eigen::Vector3d> directions_of(const Scene& scene, const Progress& progress) {
  if (!scene.description.integrator.method().bends_light()) {
    const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
    return {axes.col(0), -axes.col(0), axes.col(1), -axes.col(1), axes.col(2), -axes.col(2)};
  }
  const Surfaces& all = scene.geometry.surfaces();
  const Geometry volume({all.bounds, all.cut, std::nullopt, {}});
  std::vector<Eigen::Vector3d> directions;
  for (const AutoDirection& each : rank_directions(scene.field, volume, Eigen::Vector3d::UnitZ(), progress))
    if (directions.size() < columns) directions.push_back(each.direction);
  return directions;
}

/// "+x-z" is along (1, 0, −1).
std::string name_of(const Eigen::Vector3d& direction) {
  std::string name;
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(direction[axis]) > 0.1) name += fmt::format("{}{}", direction[axis] > 0 ? '+' : '-', "xyz"[axis]);
  return name;
}

/// Calls `visit(column, row, number, name, scene, description)` for each cell, with the field loaded once. `name` is
/// that of the direction, `description` the cell's scene with its pictures' size left open.
template <class Visit>
void for_each_cell(const ExploreOptions& options, const Progress& progress, const Visit& visit) {
  std::optional<Scene> scene;
  const auto load = [&](const SceneDescription& description) {
    Scene next = load_scene(description, progress, field_of(scene, description));
    scene.emplace(std::move(next));
  };
  SceneDescription first = with(options, {"light.direction=[0,0,-1]", "field.scale=1"});
  first.judges_scale = false;
  load(first);
  const std::vector<Eigen::Vector3d> directions = directions_of(*scene, progress);
  for (std::size_t column = 0; column < columns; ++column) {
    const Eigen::Vector3d V = scene->description.turn().transpose() * directions[column];
    const std::string direction = fmt::format("light.direction=[{},{},{}]", V.x(), V.y(), V.z());
    load(with(options, {direction}));
    const Strength strength = scene->method->strength(*scene);
    if (strength.is_fixed)
      throw std::invalid_argument(
          fmt::format("explore: `{}.{}` is a file, and has no scale; give a number", strength.section, strength.key));
    const std::string pixels = pixels_of(*scene->geometry.surfaces().plate, options.size);
    for (std::size_t row = 0; row < factors.size(); ++row) {
      const std::string scaled = fmt::format("{}.{}={}", strength.section, strength.key, factors[row] * strength.value);
      std::vector<std::string> changes = quick;
      const LightDescription& light = scene->description.light;
      if (light.wavelength_min == light.wavelength_max) changes.resize(quick_in_one_color);
      changes.insert(changes.end(),
                     {direction, scaled, pixels,
                      fmt::format("light.photons={:.0f}", photons_per_pixel * options.size * options.size),
                      fmt::format("camera.resolution=[{0},{0}]", options.size),
                      fmt::format("integrator.stretch.pixels={}", options.size)});
      changes.emplace_back("output.annotations=[]");  // No room.
      SceneDescription cell = with(options, changes);
      cell.judges_scale = false;
      load(cell);
      visit(column, row, static_cast<int>(row * columns + column) + 1, name_of(V), *scene,
            with(options, {direction, scaled}));
    }
  }
}

void check(const ExploreOptions& options, std::vector<NamedFile> inputs) {
  const std::vector<std::string> endings = image_endings();
  if (!options.sheet.empty() &&
      (ends_with(options.sheet, ".exr") || std::none_of(endings.begin(), endings.end(), [&](const std::string& ending) {
         return ends_with(options.sheet, ending);
       })))
    throw std::invalid_argument("-o " + printable(options.sheet) + ": the sheet is a .png, .jpg or .tif picture");
  if (options.sheet.empty() && options.scene_copy.empty())
    throw std::invalid_argument("nothing to do: give -o SHEET.png, or --pick N --save-scene FILE.json");
  if (options.pick.has_value() != !options.scene_copy.empty())
    throw std::invalid_argument("--pick and --save-scene belong together");
  if (!options.scene_copy.empty() && !is_field_file(options.files.front()))
    throw std::invalid_argument(
        "--save-scene: only for a field (.vdb), which stays; of a scene, change a copy by hand");
  for (const NamedFile& file : input_files(with(options, {}))) inputs.push_back(file);
  require_distinct_files(inputs, {{options.sheet, "-o"}, {options.scene_copy, "--save-scene"}});
}

void explore(ExploreOptions options, Progress& progress) {
  const Threads threads(options.threads);
  set_image_threads(static_cast<int>(running_threads()));
  const GivenField given(options.files, options.import);
  options.imported = given.imported();
  check(options, given.inputs());
  std::vector<OutputFile> files;
  for (const std::string& file : {options.sheet, options.scene_copy})
    if (!file.empty()) files.emplace_back(file);
  given.import(options.quiet);

  std::optional<ProgressBar> bar(std::in_place, progress, options.quiet);
  Sheet sheet(options.size);
  std::string picked;
  int done = 0;
  Progress within;  // The bar shows cells, not the phases of each.
  within.report = [&](const std::string&, std::uint64_t, std::uint64_t) {
    progress.update("exploring", static_cast<std::uint64_t>(done), factors.size() * columns);
  };
  for_each_cell(options, within,
                [&](std::size_t column, std::size_t row, int number, const std::string& name, const Scene& scene,
                    const SceneDescription& description) {
                  if (options.pick == number) picked = description.text;
                  if (!options.sheet.empty()) {
                    const Render rendered = render(scene, within);
                    const Strength strength = scene.method->strength(scene);
                    sheet.draw(column, row, display_image(scene, rendered, false),
                               fmt::format("{}  {}  {} {:.3g}", number, name, strength.key, strength.value));
                  }
                  ++done;
                });
  bar.reset();
  if (!options.sheet.empty())
    files.front().write([&](const std::filesystem::path& path) { write_image(path, sheet.image()); });
  if (!picked.empty()) files.back().write_text(parse_value(picked).dump(2) + "\n");
  commit_all(files);
  if (options.quiet) return;
  for (const std::string& file : {options.sheet, options.scene_copy})
    if (!file.empty()) tell_made("wrote " + file);
}

}  // namespace

void add_explore_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<ExploreOptions>();
  CLI::App* command = program.add_subcommand(
      "explore",
      "Show what a field does to light: one sheet of pictures, light along the six directions that show most, at three "
      "scales");
  command->add_option("FIELD", options->files, "Field (.vdb), a scene file, or files that `tensorray import` reads")
      ->required();
  command->add_option("-o,--output", options->sheet, "The sheet: .png .jpg .tif");
  command->add_option("--set", options->overrides, "KEY=VALUE: change a value of all scenes")->allow_extra_args(false);
  command->add_option_function<std::string>(
      "--method", [options](const auto& name) { options->overrides.push_back("integrator.type=" + name); },
      "The method that makes the pictures, as polariscope");
  command->add_option("--size", options->size, "Of a picture: pixels along its longer side (200)")
      ->check(CLI::Range(16, 2048));
  command->add_option("--pick", options->pick, "Number of the picture whose scene --save-scene writes")
      ->check(CLI::Range(1, static_cast<int>(factors.size() * columns)));
  command->add_option("--save-scene", options->scene_copy, "Write the scene of --pick to this JSON file");
  command->add_option("--threads", options->threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  add_field_options(*command, options->import, options->overrides);
  command->add_flag("-q,--quiet", options->quiet, "Print nothing but errors");
  command->callback([options, &progress] { explore(*options, progress); });
}

}  // namespace tensorray
