#pragma once
/// @file base/progress.h
/// How long work tells what it has done, and learns that it shall stop.

#include <atomic>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace tensorray {

/// Thrown out of long work when Progress::cancelled was set.
struct Cancelled : std::runtime_error {
  Cancelled() : std::runtime_error("cancelled") {}
};

struct Progress {
  /// Called now and then from the thread that called the long work; may be empty.
  std::function<void(const std::string& phase, std::uint64_t done, std::uint64_t total)> report;
  std::atomic<bool> cancelled{false};  ///< May be set from a signal handler or another thread.

  /// @throw Cancelled if it is to stop.
  void update(const std::string& phase, std::uint64_t done, std::uint64_t total) const {
    if (cancelled) throw Cancelled();
    if (report) report(phase, done, total);
  }
};

}  // namespace tensorray
