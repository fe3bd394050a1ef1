#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "base/files/output_file.h"
#include "base/process/progress.h"
#include "base/text/text.h"
#include "scenes/keys/key_visitor.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/command_line/vdb_output.h"
#include "tools/commands/commands.h"
#include "volumes/files/tensor_files.h"
#include "volumes/making/generators.h"

namespace tensorray {
namespace {

struct MakeOptions {
  Generator generator;
  GridRequest grid;
  std::filesystem::path output;
  std::string name;
  bool half = false;
};

template <class Derived>
std::string numbers(const Eigen::DenseBase<Derived>& values) {
  std::string text;
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    for (Eigen::Index j = 0; j < values.cols(); ++j) text += fmt::format("{}{}", text.empty() ? "" : " ", values(i, j));
  return text;
}

const CLI::Validator finite(
    [](std::string& text) {
      double value = 0;
      const bool is_number = CLI::detail::lexical_cast(text, value);
      return is_number && !std::isfinite(value) ? text + " is not a finite number" : std::string();
    },
    "");

/// Visits the parameters of a generator and adds a flag for each: poisson_ratio becomes --poisson-ratio.
class FlagMaker {
 public:
  explicit FlagMaker(CLI::App& command) : command_(command) {}

  void operator()(const std::string& key, double& member, const char* meaning) {
    command_.add_option(flag(key), member, meaning)->capture_default_str()->check(finite)->group("Parameters");
  }

  void operator()(const std::string& key, Eigen::Vector3d& member, const char* meaning) {
    add_list(key, meaning, 3, numbers(member),
             [&member](const std::vector<double>& values) { member = Eigen::Vector3d(values.data()); });
  }

  void operator()(const std::string& key, Eigen::Matrix3d& member, const char* meaning) {
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    add_list(key, meaning, 9, numbers(member),
             [&member](const std::vector<double>& values) { member = Eigen::Map<const RowMajor>(values.data()); });
  }

 private:
  static std::string flag(std::string key) {
    std::replace(key.begin(), key.end(), '_', '-');
    return "--" + key;
  }

  void add_list(const std::string& key, const char* meaning, int count, const std::string& standard,
                const std::function<void(const std::vector<double>&)>& set) {
    command_.add_option_function<std::vector<double>>(flag(key), set, meaning)
        ->expected(count)
        ->default_str(standard)
        ->check(finite)
        ->group("Parameters");
  }

  CLI::App& command_;
};

void set_resolution(GridRequest& grid, const std::vector<int>& values) {
  if (values.size() == 2) throw CLI::ValidationError("--resolution", "needs one number, or three: x y z");
  if (values.size() == 1)
    grid.resolution = values[0];
  else
    grid.resolution = Eigen::Vector3i(values.data());
}

void add_grid_flags(CLI::App& command, GridRequest& grid) {
  const auto standard = default_grid(generator_of(command.get_name()));
  command
      .add_option_function<std::vector<int>>(
          "--resolution", [&grid](const std::vector<int>& values) { set_resolution(grid, values); },
          "Voxels along the longest axis of the box, or along x, y and z")
      ->expected(1, 3)
      ->check(CLI::Range(1, resolution_limit))
      ->default_str(fmt::format("{}", std::get<int>(grid.resolution)))
      ->group("Grid");
  const auto add_corner = [&command](const char* flag, std::optional<Eigen::Vector3d>& corner, const char* meaning,
                                     const Eigen::Vector3d& value) {
    command
        .add_option_function<std::vector<double>>(
            flag, [&corner](const std::vector<double>& values) { corner = Eigen::Vector3d(values.data()); }, meaning)
        ->expected(3)
        ->default_str(numbers(value))
        ->check(finite)
        ->group("Grid");
  };
  if (command.get_name() == "point_load" || command.get_name() == "two_point_load")
    command
        .add_option("--levels", grid.levels, "Levels of voxels, each half as large as those before, towards the load")
        ->check(CLI::Range(1, max_levels))
        ->default_str("1")
        ->group("Grid");
  add_corner("--min", grid.min, "Least corner of the box, world", standard.min);
  add_corner("--max", grid.max, "Greatest corner of the box, world", standard.max);
}

void make(const MakeOptions& options, const Progress& progress) {
  const Threads threads;
  const GridSettings settings = choose_grid(options.generator, options.grid);
  OutputFile file(options.output);
  TensorGrid grid = generate(options.generator, settings);
  if (!options.name.empty()) grid.name = options.name;
  if (remove_non_finite(grid) > 0)
    throw std::invalid_argument("with these parameters the field is too large for single precision");
  progress.update("writing", 0, 1);
  file.write([&](const std::filesystem::path& path) { write_tensor_vdb(path, grid, options.half); });
  const auto bytes = static_cast<double>(std::filesystem::file_size(file.path()));
  progress.update("writing", 1, 1);
  file.commit();

  const Eigen::Vector3i& n = settings.resolution;
  tell_made(fmt::format("{}: field \"{}\", {} x {} x {} voxels, {}", options.output.string(), grid.name, n.x(), n.y(),
                        n.z(), bytes_text(bytes)));
}

void add_kind(CLI::App& parent, const std::string& kind, Progress& progress) {
  const auto options = std::make_shared<MakeOptions>();
  options->generator = generator_of(kind);
  CLI::App* command = parent.add_subcommand(kind, "Make a field of the kind " + kind);
  command->add_option("-o,--output", options->output, "The file to write, FILE.vdb")
      ->required()
      ->check(check_vdb_output)
      ->type_name("FILE");
  command->add_option("--name", options->name, "Name of the field")->default_str(kind);
  command->add_flag("--half", options->half, "Store 16-bit floats: three significant digits, half the size");
  std::visit([command](auto& parameters) { describe(parameters, FlagMaker(*command)); }, options->generator);
  add_grid_flags(*command, options->grid);
  command->callback([options, &progress] { make(*options, progress); });
}

}  // namespace

void add_make_command(CLI::App& program, Progress& progress) {
  CLI::App* command = program.add_subcommand("make", "Make an analytic tensor field");
  for (const std::string& kind : generator_kinds()) add_kind(*command, kind, progress);
  // CLI11 treats an unknown kind as an extra argument. Allow extras, so that the error can list the kinds.
  command->require_subcommand(0, 1)->allow_extras();
  command->callback([command] {
    if (!command->get_subcommands().empty()) return;
    const std::vector<std::string> words = command->remaining();
    const std::string wrong = words.empty() ? "KIND is missing" : "unknown kind " + words.front();
    throw CLI::ValidationError("make", wrong + "; the kinds are " + joined(generator_kinds()));
  });
}

}  // namespace tensorray
