#pragma once
/// @file base/process/work.h
/// Long work as a list of units. What a unit gives is a function of its number alone: units may be done in any order
/// and by several processes, and be kept in files. A checkpoint holds the units that a process has done so far, a shard
/// those of a fixed part. To merge is to unite such lists, to resume is to do the rest.

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace tensorray {

/// Results that an earlier run has kept, or that another process has sent, do not belong to this work. The caller that
/// knows their file adds its name.
struct DamagedWork : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The most parts that work is divided into.
constexpr std::size_t most_parts = 100000;

/// Of all units, every `count`-th one from number `index` on.
struct WorkPart {
  std::size_t index = 0, count = 1;
};

struct WorkUnit {
  std::shared_ptr<const std::string> state;  ///< What the unit has given so far; null: it was not begun.
  bool done = false;
};

class Work {
 public:
  explicit Work(WorkPart part = {}) : part_(part) {}

  /// Work that continues: with units of an earlier run.
  Work(WorkPart part, std::vector<WorkUnit> units) : part_(part), units_(std::move(units)) {}

  /// Called first by the code that does the work. @throw std::runtime_error if units were given, but not this many.
  void begin(std::size_t units);

  bool is_in_part(std::size_t unit) const { return unit % part_.count == part_.index; }

  /// The number of units; 0 before `begin`. Any thread may call this.
  std::size_t size() const;

  /// Whether a unit is in the part and is not done. Any thread may call this, `state`, `keep` and `units`.
  bool wants(std::size_t unit) const;

  /// Null if the unit was not begun.
  std::shared_ptr<const std::string> state(std::size_t unit) const;

  /// Replaces the state of a unit.
  void keep(std::size_t unit, std::string state, bool done);

  /// All units as they are now. The states are shared, so that this is quick, and never change.
  std::vector<WorkUnit> units() const;

  WorkPart part() const { return part_; }

  /// Set from outside, before the work begins, where other processes do units, too: waits for the units that this one
  /// is to do next, until there are none left. Units that it gave and that are not done, it gives again. Empty: this
  /// process does all units that are wanted.
  std::function<std::vector<std::size_t>()> next;

  /// Set from outside, before the work begins: the states of the units are wanted, and no picture.
  bool is_shard = false;

  /// Set from outside, before the work begins: seconds between two times when the states of units are written; 0: only
  /// when the run is interrupted.
  double interval = 0;

  std::atomic<bool> stopping{false};        ///< Set from outside: the work ends soon, with the units that it has.
  std::atomic<double> fraction{0};          ///< Set by the work: how much of it is done.
  std::atomic<bool> picture_wanted{false};  ///< Set from outside: the work shows what it has so far, and goes on.

 private:
  const WorkPart part_;
  mutable std::mutex mutex_;
  std::vector<WorkUnit> units_;
};

}  // namespace tensorray
