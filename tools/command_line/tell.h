#pragma once
/// Prints what the programs say about their work. What cannot be written (the log's disk is full, its reader has gone)
/// is dropped: no message is worth the work that it is about. What a command was asked for, such as `info`, is printed
/// with fmt::print instead, and is an error where it cannot be written (run_and_report.h).

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/process/progress.h"

namespace tensorray {

/// Opens standard streams that are closed, so that no file of the work gets their numbers. Writing to them stays an
/// error. Call it first in a program.
void open_standard_streams();

/// Writes `text` to standard error, as it is.
void print_error(std::string_view text) noexcept;

/// From now on, what is told calls a file by another name, as it is one that the user has not named. Call it before
/// there are threads.
void tell_as(const std::string& file, const std::string& name);

/// Text with that name.
std::string as_told(std::string text);

/// Prints `lines` on standard error, unless `quiet` is set.
void tell(const std::vector<std::string>& lines, bool quiet);

/// Prints a line on standard output that says what was made.
void tell_made(const std::string& line);

/// Becomes the `report` of a Progress until it is destroyed. Draws on standard error, and only if that is a terminal.
class ProgressBar {
 public:
  /// @param progress  Must outlive the bar.
  /// @param quiet     Draw nothing.
  ProgressBar(Progress& progress, bool quiet);

  /// Erases the line, so that the next output begins on a clean line.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

 private:
  using Clock = std::chrono::steady_clock;

  void update(const std::string& phase, std::uint64_t done, std::uint64_t total);

  Progress& progress_;
  const bool is_terminal_;  ///< Otherwise the progress is a line each minute.
  bool drawn_ = false;
  std::string phase_;
  std::uint64_t done_at_start_ = 0;
  Clock::time_point phase_start_, last_drawn_;  // Each phase measures its own rate.
};

}  // namespace tensorray
