#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "base/files/output_file.h"
#include "base/process/progress.h"
#include "base/text/text.h"
#include "tools/command_line/imported_field.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/command_line/vdb_output.h"
#include "tools/commands/commands.h"
#include "volumes/files/tensor_files.h"
#include "volumes/files/voxel_images.h"
#include "volumes/tensors/eigenvalues.h"
#include "volumes/tensors/invariants.h"

namespace tensorray {
namespace {

struct DeriveOptions {
  std::vector<std::filesystem::path> files;
  ImportChoices import;
  std::filesystem::path output;
  std::string field;
  std::vector<std::string> invariants;
};

/// Each invariant once, in the order of the options. @throw std::invalid_argument that lists the invariants.
std::vector<Invariant> chosen_invariants(const DeriveOptions& options) {
  std::vector<Invariant> chosen;
  for (const std::string& name : options.invariants) {
    const Invariant which = invariant_of(name);
    if (std::find(chosen.begin(), chosen.end(), which) == chosen.end()) chosen.push_back(which);
  }
  return chosen;
}

/// Metadata that is the same for all grids.
std::map<std::string, std::string> file_metadata(const TensorGrid& field) {
  std::map<std::string, std::string> metadata = field.metadata;
  for (const std::string& key : {std::string("tensorray:units"), negated_key}) metadata.erase(key);
  return metadata;
}

bool is_voxel_image(const std::filesystem::path& file) {
  const std::vector<std::string>& endings = voxel_image_endings();
  const std::string name = lower_case(file.string());
  return std::any_of(endings.begin(), endings.end(), [&](const auto& ending) { return ends_with(name, ending); });
}

std::string check_derived(const std::string& text) {
  if (is_voxel_image(text) || check_vdb_output(text).empty()) return "";
  return text + " must end in .vdb, " + joined(voxel_image_endings());
}

/// The number of voxels along the axes of the file that was imported; zeros: not known.
Eigen::Vector3i imported_size(const TensorGrid& field) {
  const auto found = field.metadata.find("tensorray:voxels");
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::istringstream text(found == field.metadata.end() ? "" : found->second);
  text >> size.x() >> size.y() >> size.z();
  return size;
}

void derive(const DeriveOptions& options, const Progress& progress) {
  const Threads threads;
  const GivenField given_field(options.files, options.import);
  const std::filesystem::path& given = given_field.name();
  const std::vector<Invariant> invariants = chosen_invariants(options);
  require_distinct_files(given_field.inputs(), {{options.output, "-o"}});
  given_field.import(false);
  OutputFile file(options.output);
  progress.update("reading", 0, 1);
  TensorGrid field = read_tensor_vdb(given_field.path(), options.field);
  const std::size_t removed = remove_non_finite(field);
  if (field.blocks.empty()) throw std::runtime_error(given.string() + ": no voxel of the field is finite");
  field.metadata.emplace("tensorray:field", field.name);
  std::vector<ScalarGrid> grids;
  for (const Invariant which : invariants) {
    progress.update("deriving", grids.size(), invariants.size());
    grids.push_back(invariant_grid(which, field));
  }
  progress.update("writing", 0, 1);
  file.write([&](const std::filesystem::path& path) {
    if (is_voxel_image(options.output))
      write_voxel_image(path, voxel_image(grids, imported_size(field)));
    else
      write_scalar_vdb(path, grids, file_metadata(field), field.surface);
  });
  const auto bytes = static_cast<double>(std::filesystem::file_size(file.path()));
  progress.update("writing", 1, 1);
  file.commit();

  if (removed > 0)
    tell({fmt::format("warning: {}: {} voxels are not finite and are left out", given.string(), removed)}, false);
  if (!field.finer.empty())
    tell({fmt::format("{}: the field has {} levels; the grids are of level 0", given.string(), field.finer.size() + 1)},
         false);
  std::vector<std::string> names;
  for (const ScalarGrid& grid : grids) names.push_back(grid.name);
  tell_made(fmt::format("{}: {} of field \"{}\", {} voxels, {}", options.output.string(), joined(names), field.name,
                        field.active_voxels(), bytes_text(bytes)));
}

}  // namespace

void add_derive_command(CLI::App& program, Progress& progress) {
  const auto options = std::make_shared<DeriveOptions>();
  CLI::App* command = program.add_subcommand("derive", "Make float grids of a tensor field's invariants");
  command->add_option("file", options->files, "The tensor field, FIELD.vdb, or files that `tensorray import` reads")
      ->required();
  command
      ->add_option("--invariant", options->invariants,
                   "What to derive; may be given several times: " + joined(invariant_names()) +
                       ". The grid has the invariant's name")
      ->required()
      ->type_name("NAME")
      ->allow_extra_args(false);
  command->add_option("--name", options->field, "Name of the field; not needed where there is only one");
  command
      ->add_option("-o,--output", options->output,
                   "The file to write, .vdb; or with the voxels of the field: .nii .nii.gz .nrrd .mif .vti")
      ->required()
      ->check(check_derived)
      ->type_name("FILE");
  add_import_options(*command, options->import);
  command->callback([options, &progress] { derive(*options, progress); });
}

}  // namespace tensorray
