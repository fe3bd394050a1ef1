#include "tools/command_line/tell.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/files/descriptor.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

constexpr std::chrono::milliseconds drawing_interval{100}, logging_interval{60'000};
constexpr int logged_width = 100;
std::pair<std::string, std::string> told_name;  // A file, and what it is called.
constexpr const char* clear_line = "\r\033[K";

int terminal_width() {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

std::string rate_text(double rate) {
  if (rate >= 1e9) return fmt::format("{:.1f} G/s", rate / 1e9);
  if (rate >= 1e6) return fmt::format("{:.1f} M/s", rate / 1e6);
  if (rate >= 1e3) return fmt::format("{:.1f} k/s", rate / 1e3);
  return fmt::format("{:.1f} /s", rate);
}

std::string time_text(double seconds) {
  const auto whole = static_cast<long long>(std::ceil(std::min(seconds, 1e9)));
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

/// "tracing photons   43% [##########..............]  1.2 M/s  0:12 left", cut to `width` columns.
/// @param rate  Units per second; 0: not known yet.
std::string progress_line(const std::string& phase, std::uint64_t done, std::uint64_t total, double rate, int width) {
  constexpr std::size_t bar_width = 24;
  const double fraction = total > 0 ? std::min(1.0, static_cast<double>(done) / static_cast<double>(total)) : 0;
  const auto filled = static_cast<std::size_t>(fraction * bar_width);
  std::string line = fmt::format("{}  {:3.0f}% [{}{}]", phase, std::floor(100 * fraction), std::string(filled, '#'),
                                 std::string(bar_width - filled, '.'));
  if (rate > 0) {
    const auto left = static_cast<double>(total - std::min(done, total));
    line += fmt::format("  {}  {} left", rate_text(rate), time_text(left / rate));
  }
  return line.substr(0, static_cast<std::size_t>(std::max(width, 0)));
}

}  // namespace

void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) >= 0) continue;
    // The system gives the least number that is free, which is this one, as those before it are open.
    static_cast<void>(open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

void print_error(std::string_view text) noexcept { static_cast<void>(write_whole(STDERR_FILENO, text)); }

void tell_as(const std::string& file, const std::string& name) { told_name = {file, name}; }

std::string as_told(std::string text) {
  const auto& [file, name] = told_name;
  std::size_t at = file.empty() ? text.npos : text.find(file);
  for (; at != text.npos; at = text.find(file, at + name.size())) text.replace(at, file.size(), name);
  return text;
}

void tell(const std::vector<std::string>& lines, bool quiet) {
  if (quiet) return;
  for (const std::string& line : lines) print_error(as_told(line) + "\n");
}

void tell_made(const std::string& line) {
  std::fflush(stdout);  // In the order of what was printed before.
  static_cast<void>(write_whole(STDOUT_FILENO, escaped(as_told(line)) + "\n"));
}

ProgressBar::ProgressBar(Progress& progress, bool quiet)
    : progress_(progress), is_terminal_(isatty(STDERR_FILENO) != 0), last_drawn_(Clock::now()) {
  if (quiet) return;
  progress_.report = [this](const std::string& phase, std::uint64_t done, std::uint64_t total) {
    update(phase, done, total);
  };
}

ProgressBar::~ProgressBar() {
  progress_.report = nullptr;
  if (!drawn_) return;
  print_error(clear_line);
}

void ProgressBar::update(const std::string& phase, std::uint64_t done, std::uint64_t total) {
  const Clock::time_point now = Clock::now();
  if (phase != phase_ || done < done_at_start_) {
    phase_ = phase;
    phase_start_ = now;
    done_at_start_ = done;
    if (is_terminal_) last_drawn_ = {};
  }
  if (now - last_drawn_ < (is_terminal_ ? drawing_interval : logging_interval)) return;
  last_drawn_ = now;
  const double seconds = std::chrono::duration<double>(now - phase_start_).count();
  const double rate = seconds > 0.2 ? static_cast<double>(done - done_at_start_) / seconds : 0;
  if (!is_terminal_) return tell({"tensorray: " + progress_line(phase, done, total, rate, logged_width)}, false);
  // Leave one column free, because some terminals wrap a full line.
  print_error(clear_line + progress_line(phase, done, total, rate, terminal_width() - 1));
  drawn_ = true;
}

}  // namespace tensorray
