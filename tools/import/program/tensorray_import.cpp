/// @file tools/import/program/tensorray_import.cpp
/// The program `tensorray-import`: everything that needs VTK, Teem or the NIfTI library.
///   tensorray-import ARGUMENTS...                    runs `tensorray import ARGUMENTS...`
///   tensorray-import --read-vtp EXCHANGE FILE NAME...    VTK polydata, with the named arrays → a file of vtk_files.h
/// Only volumes/points/vtk_files.h uses the last one. Its errors are one line, without the program's name.

#include <set>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "tools/command_line/interrupts.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/import/program/import_command.h"
#include "tools/import/vtk_formats/vtp_files.h"

namespace {

int read_vtp(int argc, char** argv) {
  return tensorray::answer_parent([&] {
    if (argc < 4) throw std::runtime_error("--read-vtp is for tensorray alone");
    const std::set<std::string> wanted(argv + 4, argv + argc);
    tensorray::write_poly_lines(argv[2], tensorray::read_vtp_file(argv[3], wanted));
  });
}

}  // namespace

int main(int argc, char** argv) {
  tensorray::open_standard_streams();
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--read-vtp") return read_vtp(argc, argv);
  tensorray::Progress& progress = tensorray::progress_until_interrupted();
  CLI::App app("Make a tensor field of another program's file", "tensorray import");
  tensorray::add_import_options(app, progress);
  return tensorray::run_and_report([&] {
    try {
      app.parse(argc, argv);
    } catch (const CLI::Success& request) {  // --help
      app.exit(request);
    }
  });
}
