#pragma once
/// Long work reports its progress through a Progress, and checks there whether it was cancelled.

#include <atomic>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace tensorray {

/// Thrown by long work when Progress::cancelled is set.
struct Cancelled : std::runtime_error {
  Cancelled() : std::runtime_error("cancelled") {}
};

struct Progress {
  /// Called from time to time, on the thread that called the long work; may be empty.
  std::function<void(const std::string& phase, std::uint64_t done, std::uint64_t total)> report;
  std::atomic<bool> cancelled{false};  ///< May be set from a signal handler or another thread.

  /// @throw Cancelled if `cancelled` is set.
  void update(const std::string& phase, std::uint64_t done, std::uint64_t total) const {
    if (cancelled) throw Cancelled();
    if (report) report(phase, done, total);
  }
};

}  // namespace tensorray
