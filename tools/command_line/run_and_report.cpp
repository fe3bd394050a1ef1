#include "tools/command_line/run_and_report.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "base/process/child_program.h"
#include "base/process/process_limits.h"
#include "base/text/habits.h"
#include "base/text/text.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

constexpr int failed = 1, wrong_input = 2, interrupted = 130;
const char* const help_advice = " (--help says more)";

int report(const std::string& what, int status) {
  print_error("tensorray: " + escaped(as_told(what)) + "\n");
  return status;
}

/// The library's text has the call's name in front, and the path behind.
std::string text_of(const std::filesystem::filesystem_error& error) {
  const std::string path = error.path1().string();
  if (!path.empty()) return path + ": " + error.code().message();
  return "the working folder cannot be found: " + error.code().message();
}

#ifndef TENSORRAY_SANITIZED
/// The end of a program whose exception nobody catches: one line and a status, as of any other error.
[[noreturn]] void end_by_exception() {
  std::string reason = "an unknown error";
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::system_error& error) {
    reason = error.code().message() + "; limits of threads or memory (`ulimit -u`, `ulimit -v`) may be too low";
  } catch (const std::exception& error) {
    reason = reason_of(error);
  } catch (...) {
  }
  report("ended by " + reason, failed);
  _exit(failed);
}

void expect_exceptions() { std::set_terminate(end_by_exception); }

/// Called before the libraries are initialized: one of OpenVDB's (log4cplus) starts threads then, and where it cannot,
/// its exception comes before `main`.
__attribute__((section(".preinit_array"), used)) void (*const before_libraries)() = expect_exceptions;
#endif

// Global, because a signal handler can reach nothing else.
Progress progress;
std::atomic<bool> picture_request{false};

/// For a message that names an option which is not there: the key that does what it does elsewhere.
std::string advice_on_option(const std::string& message, const CLI::App& program) {
  const CLI::App* command = &program;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  const std::size_t begin = message.find("--"), end = message.find_first_of(" =", begin);
  const bool has_keys = begin != std::string::npos && command->get_option_no_throw("--set") != nullptr;
  const std::string here = has_keys ? name_here(message.substr(begin, end - begin)) : "";
  return here.empty() ? help_advice : "; it is a key of the scene, for --set: " + here;
}

/// The command line, with "--" behind the numbers of each option that takes one or several: the parser would take the
/// name of a file for the next one.
std::vector<const char*> with_ends_of_numbers(const CLI::App& program, int argc, const char* const* argv) {
  constexpr int several = 9;  // More are a list without an end.
  std::vector<const char*> words(argv, argv + std::min(argc, 1));
  const CLI::App* command = &program;
  for (int i = 1; i < argc;) {
    const std::string word = argv[i];
    words.push_back(argv[i++]);
    const auto is_named = [&](const CLI::App* each) { return each->check_name(word); };
    for (const CLI::App* const named : command->get_subcommands(is_named)) command = named;
    if (word == "--") words.insert(words.end(), argv + std::exchange(i, argc), argv + argc);
    if (word.compare(0, 2, "--") != 0) continue;
    const std::size_t equals = word.find('=');
    const CLI::Option* const option = command->get_option_no_throw(word.substr(0, equals));
    const int most = option ? option->get_items_expected_max() : 0;
    if (most < 2 || most > several || most == option->get_items_expected_min()) continue;
    int values = equals == word.npos ? 0 : 1;
    double number = 0;
    for (; i < argc && values < most && (values == 0 || CLI::detail::lexical_cast(argv[i], number)); ++values)
      words.push_back(argv[i++]);
    if (values > 0) words.push_back("--");
  }
  return words;
}

void on_interrupt(int) {
  progress.cancelled = true;
  std::signal(SIGINT, SIG_DFL);
}

void on_picture_request(int) { picture_request = true; }

}  // namespace

std::string reason_of(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return "out of memory; lower the resolution, or the number of wavelengths";
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) return escaped(text_of(*file));
  return escaped(error.what());
}

int run_and_report(const std::function<void()>& work) {
  try {
    require_stack();
    work();
    if (std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written: the disk may be full");
    return 0;
  } catch (const CLI::RuntimeError& child) {  // The child has printed the error.
    return child.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return report(std::string(error.what()) + help_advice, wrong_input);
  } catch (const Cancelled&) {
    return report("interrupted; nothing was written", interrupted);
  } catch (const Interrupted& error) {
    return report(error.what(), interrupted);
  } catch (const std::invalid_argument& error) {
    return report(error.what(), wrong_input);
  } catch (const std::exception& error) {
    return report(reason_of(error), failed);
  } catch (...) {
    return report("failed for an unknown reason", failed);
  }
}

bool parse(CLI::App& program, int argc, char** argv) {
  try {
    const std::vector<const char*> words = with_ends_of_numbers(program, argc, argv);
    program.parse(static_cast<int>(words.size()), words.data());
    return true;
  } catch (const CLI::Success& request) {  // --help, --version
    program.exit(request);
    return false;
  } catch (const CLI::ExtrasError& error) {
    throw std::invalid_argument(error.what() + advice_on_option(error.what(), program));
  }
}

double part_of(const std::string& text, const std::string& option) {
  double value = 0;
  const bool is_percent = !text.empty() && text.back() == '%';
  if (!CLI::detail::lexical_cast(is_percent ? text.substr(0, text.size() - 1) : text, value) || !(value >= 0) ||
      !(value *= is_percent ? 0.01 : 1.0, value <= 1))
    throw std::invalid_argument(option + " " + escaped(text) + ": give a part, as 1% or 0.01");
  return value;
}

int answer_parent(const std::function<void()>& work) {
  end_with_parent();
  limit_memory();
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    work();
    return 0;
  } catch (const std::bad_alloc&) {
    print_error("it does not fit in memory\n");
  } catch (const std::exception& error) {
    print_error(std::string(error.what()) + "\n");
  }
  return failed;
}

Progress& progress_until_interrupted() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  struct sigaction hangup {};  // nohup has it ignored.
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) std::signal(SIGHUP, on_interrupt);
  std::signal(SIGUSR1, on_picture_request);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  return progress;
}

bool take_picture_request() { return picture_request.exchange(false); }

}  // namespace tensorray
