#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include "base/output_file.h"
#include "renderer/color/spectrum.h"
#include "scenes/load_scene.h"
#include "scenes/read_scene.h"
#include "scenes/stretch.h"
#include "tools/commands.h"
#include "tools/progress_bar.h"
#include "tools/tell.h"
#include "tools/vdb_output.h"
#include "volumes/files/scalar_files.h"

namespace tensorray {
namespace {

struct StretchOptions {
  std::string scene;
  std::vector<std::filesystem::path> outputs;
  std::vector<std::string> overrides;
  StretchRequest request;
  unsigned threads = 0;
  bool quiet = false;
};

bool is_grid(const std::filesystem::path& path) { return check_vdb_output(path.string()).empty(); }

/// In lower case.
std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

std::string check_output(const std::string& text) {
  const std::string ending = ending_of(text);
  const std::vector<std::string> pictures = image_endings();
  if (is_grid(text) || std::find(pictures.begin(), pictures.end(), ending) != pictures.end()) return "";
  return text + " must end in .vdb (a grid), or as a picture does: " + fmt::format("{}", fmt::join(pictures, " "));
}

/// Outputs must not take the place of what is read.
void check_inputs(const StretchOptions& options, const SceneDescription& scene) {
  std::error_code error;
  for (const std::filesystem::path& output : options.outputs)
    for (const std::filesystem::path& input : {scene.path, scene.field.file})
      if (!input.empty() && std::filesystem::equivalent(output, input, error))
        throw CLI::ValidationError("-o", output.string() + " is read by the scene; choose another name");
}

void write_grid(OutputFile& file, const Scene& scene, const StretchSettings& settings, const ScalarGrid& grid) {
  auto metadata = stretch_metadata(scene, settings);
  metadata.erase("tensorray:units");
  file.write([&](const std::filesystem::path& path) { write_scalar_vdb(path, {grid}, metadata); });
}

void write_picture(OutputFile& file, const Scene& scene, const StretchSettings& settings,
                   const StretchPicture& picture) {
  const auto metadata = stretch_metadata(scene, settings);
  const bool linear = ending_of(file.target()) == ".exr";
  file.write([&](const std::filesystem::path& path) {
    write_image(path, linear ? picture.linear : picture.display, metadata);
  });
}

void stretch(const StretchOptions& options, Progress& progress) {
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  const SceneDescription description = read_scene(options.scene, options.overrides);
  check_inputs(options, description);
  std::vector<OutputFile> files;
  for (const std::filesystem::path& output : options.outputs) files.emplace_back(output);

  std::optional<ProgressBar> bar(std::in_place, progress, options.quiet);
  const Scene scene = load_scene(description, progress);
  tell(scene.notes, options.quiet);
  const StretchSettings settings = choose_stretch(scene, options.request);
  std::optional<ScalarGrid> grid;
  std::optional<StretchPicture> picture;
  for (OutputFile& file : files) {
    if (is_grid(file.target())) {
      if (!grid) grid = stretch_grid(scene, settings, options.request.resolution, progress);
      write_grid(file, scene, settings, *grid);
    } else {
      if (!picture) picture = stretch_picture(scene, settings, options.request.pixels, progress);
      write_picture(file, scene, settings, *picture);
    }
  }
  bar.reset();
  tell({fmt::format("stretch: of light with s = {:.4g}, over a length of {:.6g}", settings.flexibility,
                    settings.length)},
       options.quiet);
  commit_all(files);
  if (!options.quiet)
    for (const std::filesystem::path& path : options.outputs) fmt::print("wrote {}\n", path.string());
}

}  // namespace

void add_stretch_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<StretchOptions>();
  CLI::App* command = program.add_subcommand(
      "stretch",
      "Tell how fast a scene's field pulls neighbouring rays apart (the finite-time Lyapunov exponent of "
      "light)");
  command->add_option("SCENE", options->scene, "Scene file, of which field, bending, light and obstacles count")
      ->required();
  command
      ->add_option(
          "-o,--output", options->outputs,
          "What to write, several if wanted: .vdb the float grid `stretch`, in the volume; .exr .png .jpg .tif "
          "a picture, of light that comes to the volume")
      ->required()
      ->check(check_output)
      ->allow_extra_args(false)
      ->type_name("FILE");
  command
      ->add_option("--length", options->request.length,
                   "How far light is followed, world units; default: the volume's depth along the light")
      ->check(CLI::PositiveNumber);
  command->add_option("--wavelength", options->request.wavelength, "Of the light, nm; default: 550, of RGB green")
      ->check(CLI::Range(observer_min, observer_max));
  command->add_option("--resolution", options->request.resolution, "Of the grid: voxels along the longest side")
      ->check(CLI::Range(2, 4096))
      ->capture_default_str();
  command->add_option("--pixels", options->request.pixels, "Of the picture: pixels along the longer side")
      ->check(CLI::Range(1, 32768))
      ->capture_default_str();
  command->add_option("--set", options->overrides, "KEY=VALUE: change a value of the scene")->allow_extra_args(false);
  command->add_option("--threads", options->threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  command->add_flag("-q,--quiet", options->quiet, "Print nothing but errors");
  command->callback([options, &progress] { stretch(*options, progress); });
}

}  // namespace tensorray
