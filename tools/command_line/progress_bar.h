#pragma once
/// @file tools/command_line/progress_bar.h
/// Progress of long work on a terminal: one line that is redrawn, and erased at the end.

#include <chrono>
#include <cstdint>
#include <string>

#include "base/process/progress.h"

namespace tensorray {

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
