#include "tools/command_line/imported_field.h"

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/process/child_program.h"
#include "base/process/progress.h"
#include "base/text/text.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

/// A scene begins with "{", or with a comment.
bool begins_as_scene(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  char first = 0;
  return !(stream >> first) || first == '{' || first == '/';
}

/// The last line of a program's errors, without its name.
std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  text.erase(0, text.find_last_of("\r\n") + 1);
  const std::string name = "tensorray: ";
  return text.rfind(name, 0) == 0 ? text.substr(name.size()) : text;
}

/// @throw std::runtime_error if it is not built.
std::filesystem::path import_program() {
  const std::filesystem::path program = sibling_program("tensorray-import");
  if (!std::filesystem::exists(program))
    throw std::runtime_error("imports need " + program.string() +
                             ", which is not built; run `tools/setup release import`");
  return program;
}

}  // namespace

void add_import_options(CLI::App& command, ImportChoices& choices) {
  for (const auto& [flag, meaning] :
       {std::pair("--order", "Of the tensor's components: vtk, fsl, mrtrix, voigt or lower, as for `tensorray import`"),
        std::pair("--array", "The array that is the tensor, likewise"),
        std::pair("--gradient-of", "The velocity whose gradient it is, likewise"),
        std::pair("--strain-of", "The displacement whose strain it is, likewise"),
        std::pair("--viscous-stress-of", "The velocity of a viscous stress, likewise"),
        std::pair("--frame", "The axes of the components, likewise"),
        std::pair("--voxel-size", "The largest edge of a voxel, likewise"),
        std::pair("--levels", "Most sizes of voxels, likewise"),
        std::pair("--resolution", "Voxels along the longest edge, likewise"),
        std::pair("--mask", "A file that is 0 where there is no tensor, likewise")})
    command.add_option(flag, choices[flag], meaning)->group("Import");
}

void add_field_options(CLI::App& command, ImportChoices& choices, std::vector<std::string>& overrides) {
  add_import_options(command, choices);
  command.add_option_function<std::string>(
      "--smooth", [&](const auto& text) { overrides.push_back("field.smooth=" + text); },
      "Smooth the field by a Gaussian whose deviation is so many voxels, as `field.smooth` does");
}

std::string flags_of(const ImportChoices& choices) {
  std::string flags;
  for (const auto& [flag, value] : choices)
    if (!value.empty()) flags += fmt::format(" {} '{}'", flag, escaped(value));
  return flags;
}

void refuse_import(const std::vector<std::filesystem::path>& files, const ImportChoices& choices) {
  const std::filesystem::path& file = files.front();
  if (files.size() > 1)
    throw std::invalid_argument(escaped(file.string()) +
                                ": several files are those of one import; this is a scene, or "
                                "a field, and is given alone");
  const std::string flags = flags_of(choices);
  if (flags.empty()) return;
  if (!std::filesystem::exists(file)) throw std::runtime_error(escaped(file.string()) + " does not exist");
  throw std::invalid_argument(flags.substr(1) + ": only files that have to be imported have this choice");
}

void become_import_program(char** arguments) {
  // A library that VTK may bring (UCX, of MPI) otherwise prints a trace of calls when the reader of a damaged file
  // crashes; tensorray says it in one line.
  setenv("UCX_HANDLE_ERRORS", "none", 0);
  become_program(import_program(), arguments);
}

bool needs_import(const std::filesystem::path& path) {
  if (path.extension() == ".vdb" || lower_case_ending(path) == ".json") return false;
  std::error_code none;
  // What is not a regular file, such as a pipe, cannot be looked into and read again.
  if (std::filesystem::is_directory(path, none)) return true;  // A case of OpenFOAM.
  return std::filesystem::is_regular_file(path, none) && !begins_as_scene(path);
}

ImportedField::ImportedField(const std::vector<std::filesystem::path>& files, const ImportChoices& choices, bool quiet)
    : path_(folder_ / "field.vdb") {
  tell_as(path_.string(), files.front().string());
  std::vector<std::string> arguments{"-o", path_.string(), "-q", "--called", files.front().string()};
  for (const auto& [option, value] : choices)
    if (!value.empty()) arguments.insert(arguments.end(), {option, value});
  if (quiet) arguments.emplace_back("--silent");
  arguments.emplace_back("--");
  for (const std::filesystem::path& file : files) arguments.push_back(file.string());
  const ProgramEnd end = run_program(import_program(), arguments, UnnamedFile());
  if (end.signal != 0)
    throw std::runtime_error(files.front().string() + ": the import crashed; the file may be damaged");
  if (end.status == 130) throw Cancelled();
  if (end.status != 0) throw std::runtime_error(last_line(end.error));
  if (!quiet) print_error(end.error);
}

std::optional<ImportedField> import_field(const std::vector<std::filesystem::path>& files, const ImportChoices& choices,
                                          bool quiet) {
  if (needs_import(files.front())) return std::optional<ImportedField>(std::in_place, files, choices, quiet);
  refuse_import(files, choices);
  return {};
}

}  // namespace tensorray
