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

/// Whether a path names a file that is neither a scene, which begins with "{" or with a comment, nor an OpenVDB file.
bool needs_import(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (path.extension() == ".vdb" || ending == ".json") return false;
  std::error_code none;
  if (std::filesystem::is_directory(path, none)) return true;  // A case of OpenFOAM.
  // What is not a regular file, such as a pipe, cannot be looked into and read again.
  if (!std::filesystem::is_regular_file(path, none)) return false;
  if (ending == ".foam" || path.filename() == "controlDict") return true;  // They begin with comments, or are empty.
  std::ifstream stream(path, std::ios::binary);
  char first = 0;
  return !(stream >> first) || (first != '{' && first != '/');
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

void become_import_program(char** arguments) {
  // A library that VTK may bring (UCX, of MPI) otherwise prints a trace of calls when the reader of a damaged file
  // crashes; tensorray says it in one line.
  setenv("UCX_HANDLE_ERRORS", "none", 0);
  become_program(import_program(), arguments);
}

GivenField::GivenField(std::vector<std::filesystem::path> files, ImportChoices choices)
    : files_(std::move(files)), choices_(std::move(choices)) {
  const std::string flags = flags_of(choices_);
  if (needs_import(name())) {
    if (const auto steps = choices_.find("--steps"); steps != choices_.end() && steps->second.front() == "all")
      throw std::invalid_argument("--steps all: makes several fields, by `tensorray import`; give one step");
    imported_ = folder_.emplace() / "field.vdb";
    tell_as(imported_.string(), name().string());
  } else if (files_.size() > 1) {
    throw std::invalid_argument(escaped(name().string()) +
                                ": several files are those of one import; this is a scene, or a field, and is given "
                                "alone");
  } else if (!flags.empty()) {
    if (!std::filesystem::exists(name())) throw std::runtime_error(escaped(name().string()) + " does not exist");
    throw std::invalid_argument(flags.substr(1) + ": only files that have to be imported have this choice");
  }
}

std::vector<NamedFile> GivenField::inputs() const {
  std::vector<NamedFile> inputs;
  for (const std::filesystem::path& file : files_) inputs.push_back({file, "the input"});
  if (const auto mask = choices_.find("--mask"); mask != choices_.end())
    inputs.push_back({mask->second.front(), "--mask"});
  return inputs;
}

void GivenField::import(bool quiet, std::size_t memory) const {
  if (!is_imported()) return;
  std::vector<std::string> arguments{"-o", imported_.string(), "-q", "--called", name().string()};
  for (const auto& [option, values] : choices_) {
    arguments.push_back(option);
    arguments.insert(arguments.end(), values.begin(), values.end());
  }
  if (memory > 0) arguments.insert(arguments.end(), {"--memory", std::to_string(memory)});
  if (quiet) arguments.emplace_back("--silent");
  arguments.emplace_back("--");
  for (const std::filesystem::path& file : files_) arguments.push_back(file.string());
  const ProgramEnd end = run_program(import_program(), arguments, UnnamedFile());
  if (end.signal != 0) throw std::runtime_error(name().string() + ": the import crashed; the file may be damaged");
  if (end.status == 130) throw Cancelled();
  if (end.status != 0) throw std::runtime_error(last_line(end.error));
  if (!quiet) print_error(end.error);
}

void GivenField::require_stays() const {
  if (!is_imported()) return;
  std::string command = "tensorray import";
  for (const std::filesystem::path& file : files_) command += " " + escaped(file.string());
  throw std::invalid_argument("--save-scene: a scene needs a field that stays; make it with `" + command +
                              flags_of(choices_) + " -o FIELD.vdb`");
}

}  // namespace tensorray
