#include "tools/command_line/import_options.h"

#include <cmath>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

std::string positive(const std::string& text) {
  double value = 0;
  const bool is_number = CLI::detail::lexical_cast(text, value);
  return is_number && std::isfinite(value) && value > 0 ? "" : text + " is no size: give a number greater than 0";
}

struct ImportOption {
  const char* flag;
  const char* values;  ///< What stands for them in the help.
  const char* meaning;
  int least = 1, most = 1;  ///< Number of values.
  CLI::Validator check = {};
};

std::vector<ImportOption> import_options() {
  const CLI::Validator size(positive, "SIZE"), number = CLI::Number;
  return {
      {"--array", "NAME",
       "The array that is the tensor (default: the only one), or its components: six or nine scalar arrays "
       "(sxx,syy,szz,sxy,syz,sxz), components of others (NAME:COMPONENT), or three vectors as rows"},
      {"--gradient-of", "NAME",
       "Take the gradient of this vector array, or of three scalar arrays (u,v,w): T_ij = dv_i/dx_j, made on the mesh "
       "itself"},
      {"--strain-of", "NAME", "Take the symmetric part of the gradient of this displacement"},
      {"--viscous-stress-of", "NAME",
       "Take the viscous stress of this velocity, T + T' - 2/3 tr T I of its gradient T"},
      {"--negate", "", "Change the sign of the tensors, for example to pressure > 0; their signs then count", 0, 0},
      {"--order", "ORDER",
       "Order of six components: vtk (xx yy zz xy yz xz), fsl (xx xy xz yy yz zz), mrtrix (xx yy zz xy xz yz), voigt "
       "(xx yy zz yz xz xy), lower (xx xy yy xz yz zz); of four: plane (xx yy zz xy), 2x2 (xx xy yx yy)"},
      {"--frame", "FRAME",
       "Axes of the components in anatomical files (NIfTI, NRRD, MetaImage, MRtrix): ras (scanner; MRtrix), lps "
       "(displacements of ITK and ANTs), voxels (tensors of ANTs and dipy), fsl (voxels, with FSL's flip); default: "
       "those of --order fsl and lower, else ras (MetaImage: lps; NRRD: its space)"},
      {"--cells", "VALUES",
       "What tensors at the cells of a mesh are in between: linear (averaged to the points, and interpolated), or "
       "constant in each cell (linear)",
       1, 1, CLI::IsMember({"linear", "constant"})},
      {"--resolution", "N",
       "Voxels along the longest edge, or along x, y and z (default: the median cell is a voxel; data on voxels keep "
       "theirs)",
       1, 3, CLI::Range(1, 8192)},
      {"--voxel-size", "SIZE", "Edge of a voxel; of .npy, the distance of its voxels, or three: x y z (default: 1)", 1,
       3, size},
      {"--origin", "X Y Z", "World x y z of the centre of the first voxel of .npy (default: 0 0 0)", 3, 3, number},
      {"--thickness", "SIZE", "Thickness of the slab that a flat mesh becomes (default: a typical edge of its cells)",
       1, 1, size},
      {"--levels", "N",
       "At most so many sizes of voxels, of which each is half of the one before, as fine as the cells of the mesh ask "
       "(default: 4)",
       1, 1, CLI::Range(1, 4)},
      {"--finest", "SIZE",
       "The least edge of a voxel (default: what the levels reach); without --voxel-size, which is the coarsest, the "
       "levels are counted from it",
       1, 1, size},
      {"--error", "PART",
       "Refine where voxels differ from the mesh by more than this part of its peak, as 1%; 0: wherever cells are "
       "smaller than voxels"},
      {"--bounds", "BOX", "Crop: xmin xmax ymin ymax zmin zmax", 6, 6, number},
      {"--mirror", "AXIS",
       "What is imported is half of a symmetric field: readers of the file add its mirror image in the plane x = 0, "
       "y = 0 or z = 0 of the file",
       1, 1, CLI::IsMember({"x", "y", "z"})},
      {"--mask", "FILE", "Of files of voxels: a file with one number in each voxel; where it is 0, there is no tensor"},
      {"--steps", "STEPS",
       "The step of time, of files that have some: last, first, or a number from 1 on; import alone: all, each in a "
       "file of its own (-o flow.####.vdb) (last)"}};
}

/// At most one of these may be given.
void exclude(CLI::App& command, const std::vector<const char*>& flags) {
  for (std::size_t i = 0; i < flags.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) command.get_option(flags[i])->excludes(command.get_option(flags[j]));
}

}  // namespace

void add_import_options(CLI::App& command, ImportChoices& choices) {
  for (const ImportOption& each : import_options()) {
    const auto keep = [&choices, flag = each.flag, has_values = each.most > 0](const CLI::results_t& values) {
      choices[flag] = has_values ? values : CLI::results_t{};
      return true;
    };
    CLI::Option* option = command.add_option(each.flag, keep, each.meaning)->expected(each.least, each.most);
    option->option_text(each.values)->group("Import");
    if (each.most == 0) option->disable_flag_override();
    if (each.check.get_active() && !each.check.get_description().empty()) option->check(each.check);
  }
  exclude(command, {"--array", "--gradient-of", "--strain-of", "--viscous-stress-of"});
  exclude(command, {"--resolution", "--voxel-size"});
  exclude(command, {"--resolution", "--finest"});
}

void add_field_options(CLI::App& command, ImportChoices& choices, std::vector<std::string>& overrides) {
  add_import_options(command, choices);
  command.add_option_function<std::string>(
      "--smooth", [&](const auto& text) { overrides.push_back("field.smooth=" + text); },
      "Smooth the field by a Gaussian whose deviation is so many voxels, as `field.smooth` does");
}

std::string flags_of(const ImportChoices& choices) {
  std::string flags;
  for (const auto& [flag, values] : choices) {
    flags += " " + flag;
    for (const std::string& value : values) flags += fmt::format(" '{}'", escaped(value));
  }
  return flags;
}

}  // namespace tensorray
