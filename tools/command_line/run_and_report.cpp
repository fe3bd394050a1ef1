#include "tools/command_line/run_and_report.h"

#include <cstdio>
#include <new>
#include <stdexcept>

#include <CLI/Error.hpp>
#include <fmt/format.h>

#include "base/progress.h"
#include "base/text.h"

namespace tensorray {
namespace {

constexpr int failed = 1, wrong_input = 2, interrupted = 130;

int report(const std::exception& error, int status) {
  fmt::print(stderr, "tensorray: {}\n", escaped(error.what()));
  return status;
}

}  // namespace

int run_and_report(const std::function<void()>& work) {
  try {
    work();
    if (std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written: the disk may be full");
    return 0;
  } catch (const CLI::RuntimeError& child) {  // The child has printed the error.
    return child.get_exit_code();
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "tensorray: {} (--help says more)\n", escaped(error.what()));
    return wrong_input;
  } catch (const Cancelled&) {
    fmt::print(stderr, "tensorray: interrupted; nothing was written\n");
    return interrupted;
  } catch (const Interrupted& error) {
    return report(error, interrupted);
  } catch (const std::invalid_argument& error) {
    return report(error, wrong_input);
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "tensorray: out of memory; lower the resolution, or the number of wavelengths\n");
    return failed;
  } catch (const std::exception& error) {
    return report(error, failed);
  }
}

}  // namespace tensorray
