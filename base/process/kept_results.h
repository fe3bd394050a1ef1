#pragma once
/// @file base/process/kept_results.h
/// Results of small parts of a render, which are computed once for several runs: a run that is interrupted keeps them
/// for the one that resumes it, and a shard for the run that merges the shards.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>

#include "base/process/seconds.h"
#include "base/process/work.h"
#include "base/text/content_hash.h"

namespace tensorray {

class PartBytes;
class Team;

/// All that a result depends on, or a hash of it, beside the scene and the program.
using ResultKey = std::array<std::uint64_t, 3>;

/// Results as bytes, by key. As the key says all that the bytes depend on, a picture has the same bits whether its
/// results are found here or computed. Results of an earlier run that are not needed do no harm, and those that are
/// missing are computed.
///
/// They are kept in the units of a Work: unit i has those of shard i, and of a render that is not divided, unit 0 has
/// all.
class KeptResults {
 public:
  /// Begins the work, which has as many units as it has parts, or as many as earlier runs have kept, and takes the
  /// results of these. @param work  Null: there are none, and none are kept.
  /// @param team  Processes that render together; process 0 gives the others its results, and it alone keeps some. All
  /// of them make one at the same time. Null: alone.
  /// @throw std::runtime_error if a unit is damaged; as Team::exchange.
  KeptResults(Work* work, Team* team);

  /// The part of the work that this run does: all of it, unless it makes a shard.
  WorkPart part() const { return part_; }
  bool is_shard() const { return is_shard_; }

  /// The bytes of a result, if there are `size` of them. Any number of threads may call it at once, but not beside
  /// `add`.
  std::optional<std::string> find(const ResultKey& key, std::size_t size) const;

  /// The same with any number of bytes.
  std::optional<std::string> find(const ResultKey& key) const;

  /// Whether there are any of earlier runs.
  bool has_any() const { return !places_.empty(); }

  /// Whether it is time to add results and to `keep` them: twice in the work's interval, and so that keeping takes at
  /// most a fiftieth of the time.
  bool is_due() const;

  /// Whether results are worth keeping: half of the work's interval has passed since this was made.
  bool is_long() const;

  /// Adds a result for later runs.
  void add(const ResultKey& key, const std::string& values);

  /// What is added from now on is parts of one result, until `forget_parts`.
  void begin_parts() { parts_from_ = bytes_.size(); }

  /// Forgets the parts, as the result is complete. Those of earlier runs are forgotten, too, if any was found: they are
  /// of this result. Not while other threads call `find`.
  void forget_parts();

  /// Keeps what was added as the unit of this run. @param done  Whether the unit is complete.
  void keep(bool done);

  /// Keeps what was added since the last time, if anything was.
  void finish();

 private:
  struct Hash {
    std::size_t operator()(const ResultKey& key) const;
  };
  void take(const std::string& bytes);
  void forget_earlier_parts();

  Work* work_;  // Null: this process keeps nothing.
  WorkPart part_;
  bool is_shard_ = false;
  std::string bytes_;                                        // Of all results, one after the other.
  std::optional<std::size_t> parts_from_;                    // Where in `bytes_` the parts begin that are added now.
  mutable std::atomic<bool> has_found_part_{false};          // Of an earlier run.
  std::size_t earlier_size_ = 0;                             // Of those of earlier runs, which come first.
  std::unordered_map<ResultKey, std::size_t, Hash> places_;  // Of these, in `bytes_`.
  std::size_t kept_size_ = 0;  // Of `bytes_`, the last time; they have changed since if it is another one.
  Clock::time_point begun_ = Clock::now(), kept_ = begun_;
  double cost_ = 0;  // Seconds of keeping, the last time.
};

/// A result that is the same for all runs of a scene: from those that were kept; else it is made, and kept if the run
/// is a long one. @param kept  Null: nothing is kept. @param make  Makes it; all processes of a team do, and process 0
/// has it then. What it adds to `kept` is parts of the result, which are forgotten once all of it is made. @param copy
/// Copies it to or from bytes. @throw what `make` throws: where that is Cancelled, what was added so far is kept;
/// std::runtime_error if the bytes that were kept are not those of a result.
void find_or_make(KeptResults* kept, const ResultKey& key, const std::function<void()>& make,
                  const std::function<void(PartBytes& bytes)>& copy);

/// Who makes together what is needed before the units of a work, and what was kept of it.
struct Preparation {
  Team* team = nullptr;         ///< Null: this process is alone.
  KeptResults* kept = nullptr;  ///< Null: nothing is kept.
};

/// A hash of values for a key; they continue those of which `before` is the hash.
inline std::uint64_t hash_of(const void* values, std::size_t size, std::uint64_t before = 0) {
  return content_hash({static_cast<const char*>(values), size}, before);
}

}  // namespace tensorray
