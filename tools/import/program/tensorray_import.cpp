/// The program `tensorray-import`: everything that needs VTK, Teem or the NIfTI library.
///   tensorray-import ARGUMENTS...                    runs `tensorray import ARGUMENTS...`
///   tensorray-import --read-vtp EXCHANGE FILE NAME...    VTK polydata, with the named arrays → a file of vtk_files.h
/// Only volumes/points/vtk_files.h uses the last one. Its errors are one line, without the program's name.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <unistd.h>

#include "base/files/descriptor.h"
#include "base/files/output_file.h"
#include "base/files/temporary_folder.h"
#include "base/process/progress.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "tools/command_line/import_options.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/command_line/vdb_output.h"
#include "tools/import/import_file.h"
#include "tools/import/program/child_process.h"
#include "tools/import/vtk_formats/vtp_files.h"
#include "volumes/bricks/brick_layout.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/files/tensor_files.h"
#include "volumes/grids/mirror.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {
namespace {

/// The fraction of the peak that sampling must keep; below it a warning is printed.
constexpr double kept_peak = 0.95;
/// The part of the body that voxels fill, below which a warning is printed.
constexpr double filled = 0.8;
/// The greatest part of voxels with a negative eigenvalue that is no reason for a warning: noise makes some.
constexpr double max_negative = 0.2;

const std::vector<std::pair<std::string, VdbCompression>> compressions = {
    {"blosc", VdbCompression::blosc}, {"zip", VdbCompression::zip}, {"none", VdbCompression::none}};

struct ImportOptions {
  ImportSettings settings;
  ImportChoices choices;
  std::string rounding, compression;
  std::filesystem::path output, boundary;
  std::string name, units, called;
  std::size_t memory = 0;  ///< Bytes; 0: without a bound.
  bool no_surface = false, half = false, quiet = false, silent = false, tells_progress = false;
};

/// What a name stands for; CLI11 has checked that there is such a name.
template <class Value>
std::optional<Value> named(const std::string& name, const std::vector<std::pair<std::string, Value>>& table) {
  for (const auto& [text, value] : table)
    if (text == name) return value;
  return {};
}

/// The value of an option; empty: it is not given.
std::string text_of(const ImportChoices& choices, const std::string& flag) {
  const auto found = choices.find(flag);
  return found == choices.end() ? "" : found->second.front();
}

/// Its numbers, which CLI11 has checked. @throw std::invalid_argument if there are two of one or three.
std::vector<double> numbers_of(const ImportChoices& choices, const std::string& flag) {
  std::vector<double> numbers;
  if (const auto found = choices.find(flag); found != choices.end())
    for (const std::string& text : found->second) CLI::detail::lexical_cast(text, numbers.emplace_back());
  if (numbers.size() == 2) throw std::invalid_argument(flag + " needs one number, or three: x y z");
  return numbers;
}

ImportSettings settings_of(const ImportOptions& options) {
  ImportSettings settings = options.settings;
  const ImportChoices& choices = options.choices;
  SamplingSettings& sampling = settings.sampling;
  const std::vector<double> resolution = numbers_of(choices, "--resolution"),
                            voxel_size = numbers_of(choices, "--voxel-size"), origin = numbers_of(choices, "--origin"),
                            bounds = numbers_of(choices, "--bounds");
  settings.array = text_of(choices, "--array");
  for (const Take take : {Take::gradient, Take::strain, Take::viscous_stress}) {
    if (choices.count(flag_of(take)) == 0) continue;
    settings.array = text_of(choices, flag_of(take));
    settings.take = take;
  }
  settings.negate = choices.count("--negate") > 0;
  settings.order = named(text_of(choices, "--order"), tensor_orders());
  settings.frame = named(text_of(choices, "--frame"), component_frames());
  settings.mask = text_of(choices, "--mask");
  settings.surface = !options.no_surface;
  if (text_of(choices, "--cells") == "constant") settings.cell_values = CellValues::constant;
  if (voxel_size.size() == 1) sampling.resolution = voxel_size[0];
  if (voxel_size.size() == 3) settings.voxel = Eigen::Vector3d(voxel_size.data());
  for (const double levels : numbers_of(choices, "--levels")) sampling.levels = static_cast<int>(levels);
  for (const double finest : numbers_of(choices, "--finest")) sampling.finest = finest;
  for (const double thickness : numbers_of(choices, "--thickness")) settings.thickness = thickness;
  if (choices.count("--error") > 0) sampling.error = part_of(text_of(choices, "--error"), "--error");
  if (!options.rounding.empty()) sampling.rounding = part_of(options.rounding, "--rounding");
  if (sampling.finest && voxel_size.size() == 1 && *sampling.finest > voxel_size[0])
    throw std::invalid_argument("--finest must not be larger than --voxel-size, which is the coarsest");
  if (resolution.size() == 1) sampling.resolution = static_cast<int>(resolution[0]);
  if (resolution.size() == 3) sampling.resolution = Eigen::Vector3i(Eigen::Vector3d(resolution.data()).cast<int>());
  if (!origin.empty()) settings.origin = Eigen::Vector3d(origin.data());
  if (settings.origin && !settings.origin->allFinite()) throw std::invalid_argument("--origin needs finite numbers");
  if (!bounds.empty()) {
    const Eigen::Vector3d min(bounds[0], bounds[2], bounds[4]), max(bounds[1], bounds[3], bounds[5]);
    if (!(min.array() <= max.array()).all())
      throw std::invalid_argument("--bounds needs xmin xmax ymin ymax zmin zmax, each min below its max");
    sampling.bounds = Eigen::AlignedBox3d(min, max);
  }
  return settings;
}

void print_lattice(const LatticeReport& report) {
  const double percent = 100.0 * static_cast<double>(report.active) / static_cast<double>(report.voxels);
  tell_made(fmt::format("  voxels as they were: {} of {} active ({:.1f}%); {} background, {} not finite", report.active,
                        report.voxels, percent, report.background, report.non_finite));
  for (const std::string& note : report.notes) tell_made(fmt::format("  {}", note));
  if (report.negative > max_negative)
    tell({fmt::format(
             "tensorray: warning: {:.0f}% of the voxels have a negative eigenvalue; if the field is a diffusion "
             "tensor, --order is wrong",
             100 * report.negative)},
         false);
}

void print_sampling(const ImportReport& report) {
  const SamplingReport& mesh = *report.mesh;
  tell_made(fmt::format("  sampled from {} cells at {} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g}; {} active",
                        report.mesh_cells, mesh.size.x(), mesh.size.y(), mesh.size.z(), mesh.voxel.x(), mesh.voxel.y(),
                        mesh.voxel.z(), mesh.active));
  tell_made(fmt::format("  norm of the tensor, mesh -> grid: peak {:.4g} -> {:.4g}, median {:.4g} -> {:.4g}",
                        mesh.native_peak, mesh.sampled_peak, mesh.native_median, mesh.sampled_median));
  if (mesh.overlaid > 0)
    tell_made(fmt::format("  {} voxels lie in several blocks, which overlap: the smallest cell counts", mesh.overlaid));
  if (mesh.non_finite > 0)
    tell_made(fmt::format("  {} {} of the mesh are not finite", mesh.non_finite, mesh.of_cells ? "cells" : "points"));
  if (mesh.sampled_peak < kept_peak * mesh.native_peak)
    tell({fmt::format(
             "tensorray: warning: the grid holds {:.0f}% of the mesh's peak norm; a larger --resolution, or --bounds "
             "around what matters, holds more",
             100 * mesh.sampled_peak / mesh.native_peak)},
         false);
}

/// Of a field of several levels. @param blocks  Of all levels.
void print_levels(const SamplingReport& mesh, std::size_t blocks, bool is_symmetric) {
  for (std::size_t i = 0; i < mesh.finer.size(); ++i)
    tell_made(fmt::format("  level {}: voxels of {:.4g} in {} refined bricks of level {}; {} active", i + 1,
                          mesh.finer[i].voxel, mesh.finer[i].bricks, i, mesh.finer[i].active));
  const double floats = CubicBrick::stored_floats(is_symmetric ? TensorBrick::symmetric : TensorBrick::general);
  if (!mesh.finer.empty())
    tell_made(
        fmt::format("  refined where voxels differ from the mesh by more than {:.3g}% of its peak (--error); {} "
                    "in memory",
                    100 * mesh.wanted_error, bytes_text(static_cast<double>(blocks) * floats * sizeof(float))));
  if (mesh.is_too_large)
    tell_made("  the next level is left out, as it would have too many voxels; --voxel-size or --finest lets it be");
}

void print_surface(const BodySurface& surface, const TriangleMesh& triangles, double voxels) {
  const std::string inner =
      surface.inner_faces > 0 ? fmt::format("; {} inner faces left out", surface.inner_faces) : "";
  if (surface.open_edges > 0)
    tell_made(fmt::format("  surface: none, as the cells' faces leave {} edges open{}", surface.open_edges, inner));
  else
    tell_made(fmt::format("  surface: {} triangles, volume {:.6g}{}, filled by voxels to {:.1f}%{}",
                          triangles.triangles.size(), triangles.volume(),
                          surface.area > 0 ? fmt::format(", area {:.6g}", surface.area) : "",
                          100 * voxels / triangles.volume(), inner));
  if (const double thickness = 2 * triangles.volume() / surface.area;
      surface.open_edges == 0 && surface.area > 0 && voxels < filled * triangles.volume())
    tell({fmt::format("tensorray: warning: voxels fill {:.0f}% of the body, whose field is continued from them to its "
                      "surface; --voxel-size {:.2g}, a quarter of its thickness, fills it",
                      100 * voxels / triangles.volume(), thickness / 4)},
         false);
}

/// Progress as a line of phase, done and total, for a program that has started this one.
void tell_progress(const std::string& phase, std::uint64_t done, std::uint64_t total) {
  static_cast<void>(write_whole(STDOUT_FILENO, fmt::format("{}\t{}\t{}\n", phase, done, total)));
}

/// The work of the child: everything except giving the files their final names.
void import_to(const ImportOptions& options, const ImportSettings& settings, OutputFile& output, Progress& progress) {
  const Threads threads;
  if (options.memory > 0) bound_memory(options.memory, std::filesystem::absolute(options.output).parent_path());
  ImportReport report;
  std::optional<ProgressBar> bar(std::in_place, progress, options.quiet);
  if (options.tells_progress) progress.report = tell_progress;
  TensorGrid grid = import_tensors(settings, progress, report);
  if (!options.name.empty()) grid.name = options.name;
  grid.metadata["tensorray:field"] = grid.name;
  if (!options.units.empty()) grid.metadata["tensorray:units"] = options.units;
  if (const std::string mirror = text_of(options.choices, "--mirror"); !mirror.empty()) {
    grid.metadata[mirror_key] = mirror;
    with_mirror_image(view_of(grid));  // Does it fit?
    report.notes.push_back(fmt::format("half of a field: readers add its mirror image in {} = 0", mirror));
  }
  progress.update("writing", 0, 1);
  const std::string name = grid.name;
  const bool is_symmetric = asymmetry(grid) < symmetric_tolerance;
  std::size_t blocks = 0;
  for (const TensorBlocks* level : levels_of(grid)) blocks += level->size();
  const Eigen::Vector3i size = grid.active_box().sizes() + Eigen::Vector3i::Ones();
  output.write([&](const std::filesystem::path& path) {
    const VdbCompression usual = settings.sampling.rounding > 0 ? VdbCompression::zip : VdbCompression::blosc;
    write_tensor_vdb(path, grid, options.half, named(options.compression, compressions).value_or(usual));
  });
  bar.reset();
  tell_made(fmt::format("{}: field \"{}\", {} x {} x {} voxels, {}", options.output.string(), escaped(name), size.x(),
                        size.y(), size.z(),
                        bytes_text(static_cast<double>(std::filesystem::file_size(output.path())))));
  if (report.lattice) print_lattice(*report.lattice);
  if (report.thickness > 0)
    tell_made(fmt::format("  a flat mesh: a slab of one voxel, {:.4g} thick{}", report.thickness,
                          settings.thickness ? "" : " (--thickness)"));
  if (report.mesh) print_sampling(report);
  if (report.mesh) print_levels(*report.mesh, blocks, is_symmetric);
  if (report.surface) print_surface(*report.surface, grid.surface, report.mesh->volume);
  for (const std::string& note : report.notes) tell_made(fmt::format("  {}", escaped(note)));
  for (const std::string& warning : report.warnings) tell({"tensorray: warning: " + warning}, false);
  if (report.boundary_triangles > 0)
    tell_made(
        fmt::format("{}: the body's surface, {} triangles", options.boundary.string(), report.boundary_triangles));
}

/// A file that the input names (the data of a header, a part of a data set) may have any name, also that of the output.
/// None of them is an OpenVDB file, and no other file is replaced. @throw std::invalid_argument
void require_replaceable(const std::filesystem::path& output) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(output, error) || std::filesystem::file_size(output, error) == 0) return;
  const std::string mark = " BDV";  // With which OpenVDB files begin.
  std::string start(mark.size(), 0);
  std::ifstream(output, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  if (start != mark)
    throw std::invalid_argument(escaped(output.string()) +
                                ": is there, and is no OpenVDB file; it may belong to what is imported: remove it, or "
                                "choose another name");
}

void check_files(const ImportOptions& options, const ImportSettings& settings) {
  std::vector<NamedFile> inputs{{settings.mask, "--mask"}};
  for (const std::filesystem::path& file : settings.files) inputs.push_back({file, "the file to import"});
  require_distinct_files(inputs, {{options.output, "-o"}, {options.boundary, "--boundary"}});
  require_replaceable(options.output);
}

std::string crash_message(const ImportSettings& settings) {
  return settings.files.front().string() +
         ": reading it ended the reader; the file is damaged or cut off, or does not fit in memory";
}

void import_step(const ImportOptions& options, ImportSettings settings, Progress& progress) {
  check_files(options, settings);
  std::vector<OutputFile> files;
  files.emplace_back(options.output);
  if (!options.boundary.empty()) {
    files.emplace_back(options.boundary);
    settings.boundary = files.back().path();
  }
  in_child_process([&] { import_to(options, settings, files.front(), progress); }, progress, crash_message(settings));
  commit_all(files);
}

/// Counts in a child process, too, which leaves the number in a file.
int count_steps(const ImportSettings& settings, Progress& progress) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "steps";
  in_child_process([&] { std::ofstream(file) << time_steps(settings); }, progress, crash_message(settings));
  int steps = 1;
  std::ifstream(file) >> steps;
  return steps;
}

/// One file for each step of time, which is there when the next step is read.
void import_all_steps(ImportOptions options, ImportSettings settings, Progress& progress) {
  const std::filesystem::path output = options.output;
  if (!has_number_sign(output.filename().string()))
    throw std::invalid_argument(output.string() +
                                ": all steps would have this name; count them by #, as in flow.####.vdb");
  const int steps = count_steps(settings, progress);
  for (int step = 0; step < steps; ++step) {
    settings.step = step;
    options.output = output.parent_path() / numbered(output.filename().string(), step + 1);
    import_step(options, settings, progress);
    options.boundary.clear();  // The body is the same.
  }
}

void import(const ImportOptions& options, Progress& progress) {
  ImportSettings settings = settings_of(options);
  std::vector<std::filesystem::path> inputs = settings.files;
  if (!settings.mask.empty()) inputs.push_back(settings.mask);
  for (const std::filesystem::path& file : inputs) {
    if (!std::filesystem::exists(file)) throw std::runtime_error(file.string() + " does not exist");
    if (is_device(file))
      throw std::runtime_error(file.string() + " is a pipe or a device; write what it gives to a file");
  }
  const std::string steps = text_of(options.choices, "--steps");
  if (steps == "all") return import_all_steps(options, settings, progress);
  const bool is_last = steps.empty() || steps == "last";
  int step = 1;
  if (!is_last && steps != "first" && (!CLI::detail::lexical_cast(steps, step) || step < 1))
    throw std::invalid_argument("--steps " + escaped(steps) + ": give all, first, last, or a number from 1 on");
  if (!is_last) settings.step = step - 1;
  import_step(options, settings, progress);
}

std::string check_ply_output(const std::string& text) {
  return std::filesystem::path(text).extension() == ".ply" ? "" : text + " must end in .ply";
}

/// Adds the options to `program`. The import runs when they are parsed. Errors are exceptions: CLI::Error and
/// std::invalid_argument where the user's input is wrong.
void add_options(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<ImportOptions>();
  add_import_options(program, options->choices);
  program.get_option("--order")->check(CLI::IsMember(tensor_orders()));
  program.get_option("--frame")->check(CLI::IsMember(component_frames()));
  program
      .add_option("--rounding", options->rounding,
                  "Round components to this part of the median norm at most, as 1%, and twice that at each level, and "
                  "compress the file with zip: with --half it is a third as large")
      ->option_text("PART");
  program
      .add_option("FILE", options->settings.files,
                  "VTK (.vti .vtr .vts .vtu .vtk .pvti .pvtr .pvts .pvtu .vtm .vth .pvd .vtkhdf), XDMF (.xdmf .xmf), "
                  "EnSight (.case), ExodusII (.ex2 .exo .e .g), CGNS "
                  "(.cgns), an OpenFOAM "
                  "case (its folder, or a .foam in it), NRRD (.nrrd .nhdr), NIfTI (.nii .nii.gz .hdr), MetaImage (.mha "
                  ".mhd), MRtrix (.mif .mif.gz .mih), NumPy (.npy); "
                  "of PLOT3D two, the grid and its q; of Nemesis (NAME.N.0 ...) any of the pieces")
      ->required()
      ->expected(1, CLI::detail::expected_max_vector_size)
      ->option_text("FILE...");
  program.add_option("-o,--output", options->output, "The field to write, FILE.vdb")
      ->required()
      ->check(check_vdb_output)
      ->option_text("FILE");
  program
      .add_option("--boundary", options->boundary,
                  "Write the surface of the body that the mesh lies around, for `obstacles`: FILE.ply")
      ->check(check_ply_output)
      ->option_text("FILE");
  program.add_flag("--no-surface", options->no_surface,
                   "Leave out the surface of the body that a mesh is, within which light bends");
  program
      .add_option("--memory", options->memory,
                  "Keep voxels in files on the disk of the output, of which the system has in memory what is free, "
                  "whatever the size, as 8G or 500M")
      ->transform(CLI::AsSizeValue(false))
      ->check([](const std::string& bytes) {  // CLI11 makes large numbers of negative ones.
        const bool is_size = bytes.find('-') == std::string::npos && bytes.size() <= 18;
        return is_size ? "" : "it must be a size, as 8G";
      })
      ->option_text("SIZE");
  program.add_option("--name", options->name, "Name of the field (default: the array's)");
  program.add_option("--units", options->units, "Units of the tensor, noted in the file");
  program
      .add_option("--compression", options->compression,
                  "Of the file's values (default: zip with --rounding, else blosc); none: for an archive, as .tar.xz")
      ->check(CLI::IsMember(compressions));
  program.add_flag("--half", options->half, "Store 16-bit floats: three significant digits, half the size");
  program.add_flag("-q,--quiet", options->quiet, "No progress bar");
  program.add_flag("--tell-progress", options->tells_progress)->group("");  // For the Python package.
  program.add_flag("--silent", options->silent)->group("");                 // For commands that print nothing else.
  program.add_option("--called", options->called)->group("");  // The output, for commands that do not keep it.
  program.callback([options, &progress] {
    if (options->silent && !std::freopen("/dev/null", "w", stdout)) throw std::runtime_error("/dev/null is missing");
    if (!options->called.empty()) tell_as(options->output.string(), options->called);
    import(*options, progress);
  });
}

int read_vtp(int argc, char** argv) {
  return answer_parent([&] {
    if (argc < 4) throw std::runtime_error("--read-vtp is for tensorray alone");
    const std::set<std::string> wanted(argv + 4, argv + argc);
    write_poly_lines(argv[2], read_vtp_file(argv[3], wanted));
  });
}

}  // namespace
}  // namespace tensorray

int main(int argc, char** argv) {
  tensorray::open_standard_streams();
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--read-vtp") return tensorray::read_vtp(argc, argv);
  tensorray::Progress& progress = tensorray::progress_until_interrupted();
  CLI::App app("Make a tensor field of another program's file", "tensorray import");
  tensorray::add_options(app, progress);
  return tensorray::run_and_report([&] { tensorray::parse(app, argc, argv); });
}
