#include "tools/commands/imported_field.h"

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "base/process/child_program.h"
#include "base/process/progress.h"
#include "base/text/text.h"
#include "integrators/methods/read_scene.h"
#include "tools/command_line/tell.h"
#include "tools/commands/commands.h"

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

void become_import_program(char** arguments) {
  // A library that VTK may bring (UCX, of MPI) otherwise prints a trace of calls when the reader of a damaged file
  // crashes; tensorray says it in one line.
  setenv("UCX_HANDLE_ERRORS", "none", 0);
  become_program(import_program(), arguments);
}

bool needs_import(const std::filesystem::path& path) {
  if (is_field_file(path) || lower_case_ending(path) == ".json") return false;
  std::error_code none;
  // What is not a regular file, such as a pipe, cannot be looked into and read again.
  return std::filesystem::is_regular_file(path, none) && !begins_as_scene(path);
}

ImportedField::ImportedField(const std::filesystem::path& file, const ImportChoices& choices, bool quiet)
    : path_(folder_ / "field.vdb") {
  std::vector<std::string> arguments{"-o", path_.string(), "-q"};
  for (const auto& [option, value] : choices)
    if (!value.empty()) arguments.insert(arguments.end(), {option, value});
  arguments.insert(arguments.end(), {"--", file.string()});
  const ProgramEnd end = run_program(import_program(), arguments, UnnamedFile());
  if (end.signal != 0) throw std::runtime_error(file.string() + ": the import crashed; the file may be damaged");
  if (end.status == 130) throw Cancelled();
  if (end.status != 0) throw std::runtime_error(last_line(end.error));
  if (!quiet) print_error(end.error);
}

}  // namespace tensorray
