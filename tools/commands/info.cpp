#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/text/path_text.h"
#include "base/text/text.h"
#include "integrators/methods/read_scene.h"
#include "tools/command_line/imported_field.h"
#include "tools/command_line/threads.h"
#include "tools/commands/commands.h"
#include "volumes/files/tensor_files.h"
#include "volumes/making/field_making.h"
#include "volumes/making/smoothing.h"
#include "volumes/tensors/statistics.h"

namespace tensorray {
namespace {

using Json = nlohmann::ordered_json;

constexpr double voxel_step_flexibility = 0.3;  // The strongest flexibility in the paper.

struct InfoOptions {
  std::vector<std::filesystem::path> files;
  ImportChoices import;
  std::filesystem::path field_file;  ///< The file, or the field made of the files.
  std::string field;
  Derive derive = Derive::none;
  double smooth = 0;  ///< Voxels.
  bool json = false;
};

/// Everything that is printed about a field.
struct FieldInfo {
  std::string name;
  Eigen::Matrix4d transform;  ///< From voxel indices to world.
  std::map<std::string, std::string> metadata;
  FieldStatistics statistics;
  TriangleMesh surface;
  Resolution resolution;

  double stable_step_in_voxels() const {
    return statistics.stable_step(voxel_step_flexibility) / statistics.voxel_size.minCoeff();
  }
};

FieldInfo field_info(const InfoOptions& options, const std::string& name) {
  TensorGrid grid = read_tensor_vdb(options.field_file, name, options.derive);
  if (options.smooth > 0) {
    remove_non_finite(grid);
    smooth(grid, options.smooth);
  }
  FieldInfo info{grid.name, grid.to_world.matrix(), grid.metadata, field_statistics(grid), grid.surface, {}};
  if (info.statistics.active_voxels > info.statistics.non_finite) {
    const Border border = grid.surface.triangles.empty() ? Border::fade : Border::extend;
    const MadeField made = make_field(view_of(grid), Eigenvalues::raw, {Interpolation::cubic, border});
    info.resolution = made.resolution;
    info.statistics.memory_bytes = made.field->memory_bytes();
  }
  return info;
}

std::vector<FieldInfo> field_infos(const InfoOptions& options, const std::vector<GridInfo>& grids) {
  std::vector<std::string> names = tensor_names(grids);
  if (!options.field.empty() || options.derive != Derive::none) names = {options.field};
  std::vector<FieldInfo> fields;
  for (const std::string& name : names) fields.push_back(field_info(options, name));
  return fields;
}

// As JSON.

template <class Scalar, int size>
Json to_json(const Eigen::Matrix<Scalar, size, 1>& vector) {
  return std::vector<Scalar>(vector.data(), vector.data() + size);
}

template <class Box>
Json box_to_json(const Box& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", to_json(typename Box::VectorType(box.min()))}, {"max", to_json(typename Box::VectorType(box.max()))}};
}

Json to_json(const Eigen::Matrix4d& matrix) {
  Json rows = Json::array();
  for (int i = 0; i < 4; ++i) rows.push_back(to_json(Eigen::Vector4d(matrix.row(i))));
  return rows;
}

Json to_json(const FieldInfo& field) {
  const FieldStatistics& s = field.statistics;
  Json norm;
  for (std::size_t i = 0; i < s.norm.size(); ++i) norm[fmt::format("p{}", s.percentiles[i])] = s.norm[i];
  Json json;
  json["name"] = field.name;
  json["index_to_world"] = to_json(field.transform);
  json["index_extent"] = box_to_json(s.index_box);
  json["world_extent"] = box_to_json(s.world_box);
  json["voxel_size"] = to_json(s.voxel_size);
  json["active_voxels"] = s.active_voxels;
  if (s.voxels_of_levels.size() > 1) json["voxels_of_levels"] = s.voxels_of_levels;
  json["non_finite_voxels"] = s.non_finite;
  json["memory_bytes"] = s.memory_bytes;
  json["norm"] = norm;
  json["eigenvalues"] = {{"real_min", s.real_min},
                         {"real_max", s.real_max},
                         {"imaginary_max", s.imaginary_max},
                         {"complex_fraction", s.complex_fraction},
                         {"negative_fraction", s.negative_fraction}};
  json["asymmetry"] = s.asymmetry;
  json["absolute_loss"] = s.absolute_loss;
  json["deviator_max"] = s.deviator_max;
  json["linear_to_cubic"] = {{"cells", field.resolution.cells},
                             {"median", field.resolution.median},
                             {"percentile_90", field.resolution.percentile_90},
                             {"percentile_99", field.resolution.percentile_99},
                             {"too_coarse", is_coarse(field.resolution)}};
  // Infinite for a field that does not bend light. JSON has no number for that and gets null.
  json["stable_step"] = {{"world_at_flexibility_1", s.stable_step(1)},
                         {"voxels_at_flexibility_0.3", field.stable_step_in_voxels()}};
  if (!field.surface.triangles.empty())
    json["surface"] = {{"triangles", field.surface.triangles.size()}, {"volume", field.surface.volume()}};
  json["metadata"] = field.metadata;
  return json;
}

void print_json(const InfoOptions& options, const std::vector<GridInfo>& grids, const std::vector<FieldInfo>& fields) {
  Json json = {{"file", text_of_path(options.files.front())}, {"grids", Json::array()}, {"fields", Json::array()}};
  for (const GridInfo& grid : grids)
    json["grids"].push_back({{"name", grid.name}, {"type", grid.type}, {"storage", grid.storage}});
  for (const FieldInfo& field : fields) json["fields"].push_back(to_json(field));
  fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
}

// As text.

void print_row(const std::string& label, const std::string& value) { fmt::print("  {:<24}{}\n", label, value); }

template <class Vector>
std::string text(const Vector& vector) {
  std::string numbers;
  for (Eigen::Index i = 0; i < vector.size(); ++i)
    numbers += fmt::format("{}{:.6g}", i == 0 ? "" : " ", static_cast<double>(vector[i]));
  return numbers;
}

template <class Box>
std::string box_text(const Box& box) {
  if (box.isEmpty()) return "none";
  return fmt::format("({}) to ({})", text(box.min()), text(box.max()));
}

/// Rounded, so that a value that is 0 except for rounding errors is printed as 0; + 0 turns −0 into 0.
std::string percent(double fraction) { return fmt::format("{:.4g} %", std::round(1e8 * fraction) / 1e6 + 0.0); }

void print_grid(const FieldInfo& field) {
  const FieldStatistics& s = field.statistics;
  for (int i = 0; i < 4; ++i) print_row(i == 0 ? "index to world" : "", text(Eigen::Vector4d(field.transform.row(i))));
  print_row("extent, index", box_text(s.index_box));
  print_row("extent, world", box_text(s.world_box));
  print_row("voxel size", text(s.voxel_size));
  print_row("active voxels", fmt::format("{}", s.active_voxels));
  if (s.voxels_of_levels.size() > 1)
    print_row("voxels by level", fmt::format("{}", fmt::join(s.voxels_of_levels, ", ")));
  print_row("not finite", fmt::format("{}", s.non_finite));
  print_row("memory", bytes_text(static_cast<double>(s.memory_bytes)));
  if (!field.surface.triangles.empty())
    print_row("surface of the body",
              fmt::format("{} triangles, volume {:.6g}", field.surface.triangles.size(), field.surface.volume()));
}

void print_tensors(const FieldStatistics& s) {
  std::string heads, norms;
  for (std::size_t i = 0; i < s.norm.size(); ++i) {
    heads += fmt::format("{:>11}", fmt::format("{} %", s.percentiles[i]));
    norms += fmt::format("{:>11.4g}", s.norm[i]);
  }
  print_row("percentile", heads);
  print_row("norm", norms);
  print_row("eigenvalues, real", fmt::format("{:.6g} to {:.6g}", s.real_min, s.real_max));
  print_row("eigenvalues, imaginary", fmt::format("up to {:.6g}", s.imaginary_max));
  print_row("complex", percent(s.complex_fraction) + " of the voxels");
  print_row("negative", percent(s.negative_fraction) + " of the voxels have an eigenvalue with a negative real part");
  print_row("asymmetry", fmt::format("{:.4g} (0 symmetric, 2 antisymmetric)", s.asymmetry));
  print_row("absolute would erase", percent(s.absolute_loss) + " of the squared norm (rotation and shear)");
}

void print_resolution(const Resolution& resolution) {
  if (resolution.cells == 0) return;
  print_row(
      "between voxels",
      fmt::format("linear and cubic differ by {} of the norm (median), {} (90 % of the cells), {} (99 %)",
                  percent(resolution.median), percent(resolution.percentile_90), percent(resolution.percentile_99)));
  if (is_coarse(resolution))
    print_row("", "too coarse to trust, or noise: structures of two voxels; sample it more finely, or smooth it");
}

void print_field(const FieldInfo& field) {
  const FieldStatistics& s = field.statistics;
  fmt::print("\nfield \"{}\"\n", field.name);
  print_grid(field);
  if (s.active_voxels > s.non_finite) print_tensors(s);
  print_resolution(field.resolution);
  const bool bends = std::isfinite(s.stable_step(1));
  print_row("stable step, world", bends ? fmt::format("{:.4g} at s = 1", s.stable_step(1)) : "any");
  print_row("stable step, voxels",
            bends ? fmt::format("{:.4g} at s = {}", field.stable_step_in_voxels(), voxel_step_flexibility) : "any");
  for (const auto& [key, value] : field.metadata) print_row(key, value);
}

void print_text(const InfoOptions& options, const std::vector<GridInfo>& grids, const std::vector<FieldInfo>& fields) {
  std::size_t width = 4;
  for (const GridInfo& grid : grids) width = std::max(width, grid.name.size());
  fmt::print("{}\n  {:<{}}  {:<10}  {}\n", options.files.front().string(), "grid", width, "type", "stored as");
  for (const GridInfo& grid : grids) fmt::print("  {:<{}}  {:<10}  {}\n", grid.name, width, grid.type, grid.storage);
  for (const FieldInfo& field : fields) print_field(field);
  if (fields.empty())
    fmt::print(
        "no tensor field; `--derive gradient` tells of that of a vector grid, `--derive hessian` of that of a scalar "
        "grid, and `field.derive` in a scene makes it\n");
}

void info(InfoOptions options) {
  const Threads threads;
  const GivenField given(options.files, options.import);
  given.import(options.json);
  options.field_file = given.path();
  if (!given.is_imported()) {
    std::signal(SIGINT, SIG_DFL);  // This command writes no file, so Ctrl-C may end it at once.
    std::signal(SIGTERM, SIG_DFL);
  }
  const std::vector<GridInfo> grids = list_vdb(options.field_file);
  const std::vector<FieldInfo> fields = field_infos(options, grids);
  (options.json ? print_json : print_text)(options, grids, fields);
}

}  // namespace

void add_info_command(CLI::App& program) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* command = program.add_subcommand("info", "Tell what an OpenVDB file, or another program's, holds");
  command
      ->add_option("file", options->files, "The file, FILE.vdb, or files that `tensorray import` reads: of their field")
      ->required();
  command->add_option("--field", options->field, "Only this tensor field; without it, all");
  command
      ->add_option("--derive", options->derive,
                   "Tell of the tensor that is derived from the grid --field, or from the only one: the gradient of a "
                   "vector grid, the hessian of a scalar grid, or the viscous stress of a velocity or of its gradient")
      ->transform(CLI::Transformer(std::map<std::string, Derive>{
          {"gradient", Derive::gradient}, {"hessian", Derive::hessian}, {"viscous_stress", Derive::viscous_stress}}));
  add_import_options(*command, options->import);
  command->add_option("--smooth", options->smooth, "Smooth the field first, by so many voxels (`field.smooth`)")
      ->check(CLI::Range(0.0, max_smoothing));
  command->add_flag("--json", options->json, "As JSON");
  command->callback([options] { info(*options); });
}

void add_schema_command(CLI::App& program) {
  CLI::App* command = program.add_subcommand("schema", "Print the JSON Schema of scene files");
  command->callback([] { fmt::print("{}\n", scene_schema(SchemaKind::with_keyframes)); });
}

}  // namespace tensorray
