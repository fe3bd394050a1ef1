/// The program `tensorray-view`: a web server for the live view. `tensorray view` starts it.

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/process/child_program.h"
#include "integrators/methods/read_scene.h"
#include "renderer/images/image.h"
#include "tools/command_line/imported_field.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/viewer/pages.h"
#include "tools/viewer/server/server.h"

namespace {

using namespace tensorray;

constexpr std::uint16_t usual_port = 8787;
constexpr int ports_to_try = 20;

struct ViewOptions {
  std::vector<std::filesystem::path> files;
  ImportChoices import;
  ViewedScene viewed;
  ServerSettings server;
  std::optional<std::uint16_t> port;
  unsigned threads = 0;
  bool quiet = false;
};

/// Where the page is: beside the folder of the programs in a build folder, or else where it is installed.
std::filesystem::path page_folder() {
  const std::filesystem::path prefix = sibling_program("tensorray-view").parent_path().parent_path();
  const std::filesystem::path installed = prefix / "share" / "tensorray" / "view";
  return std::filesystem::exists(installed) ? installed : prefix / "view";
}

/// NAME.view.json, beside the scene.
std::filesystem::path default_copy(std::filesystem::path scene) { return scene.replace_extension(".view.json"); }

/// The command line that renders what is viewed, from any folder.
std::vector<std::string> command_of(const ViewOptions& options) {
  std::vector<std::string> words{sibling_program("tensorray").string(), "render"};
  for (const std::filesystem::path& file : options.files) words.push_back(std::filesystem::absolute(file).string());
  for (const auto& [flag, values] : options.import) {
    words.push_back(flag);
    for (const std::string& value : values)
      words.push_back(flag == "--mask" ? std::filesystem::absolute(value).string() : value);
  }
  for (const std::string& change : options.viewed.overrides) words.insert(words.end(), {"--set", change});
  return words;
}

/// The usual port, or if another program has it, one of the next.
Server listen(const ViewOptions& options, Pages& pages) {
  ServerSettings settings = options.server;
  for (int next = 0;; ++next) {
    settings.port = options.port.value_or(static_cast<std::uint16_t>(usual_port + next));
    try {
      return Server(settings, pages);
    } catch (const std::runtime_error&) {
      if (options.port || next + 1 == ports_to_try) throw;
    }
  }
}

void view(ViewOptions options, Progress& progress) {
  const Threads threads(options.threads);
  set_image_threads(static_cast<int>(running_threads()));
  const GivenField given(options.files, options.import);
  if (!options.viewed.copy.empty()) given.require_stays();
  const std::filesystem::path& name = given.name();
  options.viewed.file = name.has_filename() ? name : name.parent_path();  // "case/"
  options.viewed.imported = given.imported();
  if (!given.is_imported() && options.viewed.copy.empty()) options.viewed.copy = default_copy(options.viewed.file);
  require_same_folder(options.viewed.file, options.viewed.copy);
  given.import(options.quiet);
  options.viewed.command = command_of(options);
  options.server.token = token_of_user();
  options.server.page = page_folder();

  std::optional<ProgressBar> bar(std::in_place, progress, options.quiet);
  Pages pages(options.viewed, progress);
  bar.reset();
  Server server = listen(options, pages);
  fmt::print("{}\n", server.url());
  if (!options.quiet) fmt::print("Open this address in a browser. Ctrl-C ends the view.\n");
  if (std::fflush(stdout) != 0)
    throw std::runtime_error("the address cannot be written to standard output: " +
                             std::generic_category().message(errno));
  server.run(progress);
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  Progress& progress = progress_until_interrupted();
  ViewOptions options;
  CLI::App app("Look at a scene in a browser and change it there: the picture follows", "tensorray view");
  app.add_option("SCENE", options.files, "Scene (.json), field (.vdb), or files that `tensorray import` reads")
      ->required();
  app.add_option("--set", options.viewed.overrides, "KEY=VALUE: change a value of the scene")->allow_extra_args(false);
  app.add_option("--save-scene", options.viewed.copy,
                 "The file to which the page may save its scene (NAME.view.json beside the scene)");
  app.add_option("--port", options.port, "Port to listen on (8787, or the next that is free)");
  app.add_option("--listen", options.server.address,
                 "Address to listen on (127.0.0.1: this machine alone). With 0.0.0.0 all machines of the network reach "
                 "the view; its address is then the only secret, and is sent unencrypted");
  app.add_option("--host", options.server.hosts, "A further name by which browsers may call this machine")
      ->allow_extra_args(false);
  app.add_option("--threads", options.threads, "Number of threads (all)")->check(CLI::Range(1, 4096));
  add_field_options(app, options.import, options.viewed.overrides);
  app.add_flag("-q,--quiet", options.quiet, "Print only the address");
  return run_and_report([&] {
    if (parse(app, argc, argv)) view(options, progress);
  });
}
