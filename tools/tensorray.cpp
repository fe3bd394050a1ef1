/// @file tools/tensorray.cpp
/// The command line: picks the command, and turns errors into one line and an exit status.

#include <csignal>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "integrators/progress.h"
#include "scenes/read_scene.h"
#include "tools/commands.h"

namespace {

constexpr int failed = 1, wrong_input = 2, interrupted = 130;

tensorray::Progress progress;  // Global, as a signal handler can reach nothing else.

void on_interrupt(int) {
  progress.cancelled = true;
  std::signal(SIGINT, SIG_DFL);  // A second Ctrl-C ends the program at once.
}

int report(const std::exception& error, int status) {
  fmt::print(stderr, "tensorray: {}\n", error.what());
  return status;
}

/// CLI11 says no more of an unknown command than that one is required.
void require_known_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::string known;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == argv[1]) return;
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  throw std::invalid_argument(fmt::format("unknown command `{}`; there are {}", argv[1], known));
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  std::signal(SIGXFSZ, SIG_IGN);  // A file-size limit is then an error of the write, as a full disk is.
  std::signal(SIGPIPE, SIG_IGN);

  CLI::App app("tensorray: light through tensor fields (Zheng and Pang 2003)", "tensorray");
  app.set_version_flag("--version", "tensorray " TENSORRAY_VERSION);
  app.require_subcommand(1);
  tensorray::add_render_command(app, progress);
  tensorray::add_make_command(app, progress);
  tensorray::add_info_command(app);
  tensorray::add_schema_command(app);
  try {
    require_known_command(app, argc, argv);
    app.parse(argc, argv);
    if (std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written: the disk may be full");
    return 0;
  } catch (const CLI::Success& request) {  // --help, --version
    return app.exit(request);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "tensorray: {} (--help says more)\n", error.what());
    return wrong_input;
  } catch (const tensorray::Cancelled&) {
    fmt::print(stderr, "tensorray: interrupted; nothing was written\n");
    return interrupted;
  } catch (const tensorray::SceneError& error) {
    return report(error, wrong_input);
  } catch (const std::invalid_argument& error) {
    return report(error, wrong_input);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "tensorray: out of memory; lower the resolution, or the number of wavelengths\n");
    return failed;
  } catch (const std::exception& error) {
    return report(error, failed);
  }
}
