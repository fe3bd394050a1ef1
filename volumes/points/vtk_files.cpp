#include "volumes/points/vtk_files.h"

#include <stdexcept>
#include <system_error>

#include "base/process/child_program.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

/// @throw std::runtime_error with the error that the program printed, or with `on_crash` if it printed none.
void run_vtk_program(const std::vector<std::string>& arguments, const UnnamedFile& shared,
                     const std::string& on_crash) {
  const std::filesystem::path program = sibling_program("tensorray-import");
  std::error_code none;
  if (!std::filesystem::exists(program, none))
    throw std::runtime_error("files of VTK need " + program.string() +
                             ", which is not built; run `tools/setup release import`");
  const ProgramEnd end = run_program(program, arguments, shared);
  if (end.signal != 0) throw std::runtime_error(on_crash);
  if (end.status == 0) return;
  const std::string reason = one_line(end.error);
  throw std::runtime_error(reason.empty() ? on_crash : reason);
}

}  // namespace

PolylineData read_vtp_lines(const std::filesystem::path& path, const std::set<std::string>& wanted) {
  const UnnamedFile shared;
  std::vector<std::string> arguments{"--read-vtp", shared_file, path.string()};
  arguments.insert(arguments.end(), wanted.begin(), wanted.end());
  run_vtk_program(arguments, shared,
                  "reading it ended the reader; the file is damaged or cut off, or does not fit in memory");
  return read_poly_lines(shared.path());
}

}  // namespace tensorray
