#pragma once
/// Long work as a list of units: a tile, rows of pixels, a part of the photons, a flow map. What a unit gives is a
/// function of its number, the scene and the program alone, and is kept under its name. Four drivers use this:
/// - a checkpoint is a file of all results so far; to resume is to begin with them;
/// - a shard is a file of the results of every Nth unit;
/// - to merge shards is to begin with the results of all;
/// - ranks (ranks.h) make every Nth unit, and give it to the others.

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "base/process/archive.h"
#include "base/process/progress.h"
#include "base/process/ranks.h"
#include "base/process/seconds.h"

namespace tensorray {

/// Shards that work is divided into, at most.
constexpr std::size_t max_shards = 100000;

/// Of all units, every `count`-th one from number `index` on.
struct WorkPart {
  std::size_t index = 0, count = 1;
};

/// Results as bytes, by their names: "tile 17".
using Result = std::shared_ptr<const std::string>;
using Results = std::map<std::string, Result>;

/// What is made before the units of all shards, and is the same for all of them, has a name that begins with this.
inline const std::string light_name = "light ";

/// Any number of threads may use it at once.
class Job {
 public:
  /// @param results  Of earlier runs.
  explicit Job(WorkPart part = {}, Results results = {}) : part_(part), results_(std::move(results)) {}

  /// Null if there is none.
  Result find(const std::string& name) const;
  void keep(const std::string& name, std::string bytes);

  /// All that there are now. They never change.
  Results results() const;

  /// Of a shard: what it makes. Of other runs: the parts in which results of shards are found.
  WorkPart part() const { return part_; }

  /// Whether this run makes a unit.
  bool has(std::size_t unit) const { return !is_shard || unit % part_.count == part_.index; }

  /// Whether results that need no more than the time before them may be worth keeping: half of the interval has passed.
  bool is_long() const { return is_root(ranks) && interval > 0 && seconds_since(begun_) >= interval / 2; }

  /// Whether such a result is worth its bytes: a shard's serves others; a checkpoint holds what takes long for its
  /// size.
  bool is_worth(std::size_t bytes, double seconds) const {
    constexpr double bytes_per_second = 1e6;
    return is_shard || static_cast<double>(bytes) <= bytes_per_second * seconds;
  }

  // Set from outside, before the work begins:
  bool is_shard = false;   ///< Results of the part are wanted, and no picture.
  double interval = 0;     ///< Seconds between checkpoints; 0: only where the run is interrupted.
  Ranks* ranks = nullptr;  ///< Processes that do the same work with this one; null: alone.

  std::atomic<bool> stopping{false};        ///< The work ends soon, with the units that it has.
  std::atomic<bool> picture_wanted{false};  ///< Set from outside: the work shows what it has so far, and goes on.
  std::atomic<double> fraction{0};          ///< Set by the work: how much of it is done.

 private:
  const WorkPart part_;
  const Clock::time_point begun_ = Clock::now();
  mutable std::mutex mutex_;
  Results results_;
};

/// A step of the work whose units are independent of each other.
struct Units {
  std::size_t count = 0;
  std::function<void(std::size_t unit)> make;                    ///< Any thread may call it.
  std::function<void(std::size_t unit, Archive& archive)> copy;  ///< What a unit has given, to or from bytes.

  std::string kind;             ///< With the number, the name of its result; empty: it is not kept, and all shards make
                                ///< it.
  bool for_all = false;         ///< Whether all ranks need it, or only the root.
  std::size_t round = 4096;     ///< Units that are made before they are given to others, and kept.
  std::size_t first = 0;        ///< For the progress: units before them, ...
  std::size_t total = 0;        ///< ... and of the whole; 0: `count`.
  std::function<void()> shown;  ///< Called after each round but the last; may be empty.
};

/// Makes the units of this run on all threads, or takes them from what was kept.
/// @param job  Null: this process alone makes all. @param phase  Of the progress.
/// @throw Cancelled; DamagedArchive; as Ranks::all_gather; what `make` and `copy` throw.
void make_units(const Units& units, Job* job, const std::string& phase, const Progress& progress);

/// A result that is found, or made; it is kept if that took long, also for its size. @param job  Null: it is made.
/// @param make  All ranks call it, and have it then. @param copy  To or from bytes. @throw as above.
void find_or_make(Job* job, const std::string& name, const std::function<void()>& make,
                  const std::function<void(Archive& archive)>& copy);

}  // namespace tensorray
