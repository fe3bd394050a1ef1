#pragma once
/// Processes that make one result together: each runs the same code, does every `count`-th unit of each step, and gives
/// it to the others. As in MPI, rank 0 is the root.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/process/archive.h"

namespace tensorray {

/// This process among the ranks. All ranks call the same functions in the same order, from one thread each.
class Ranks {
 public:
  virtual ~Ranks() = default;

  virtual std::size_t rank() const = 0;
  virtual std::size_t count() const = 0;

  /// What all ranks give, by rank. Waits for all. @throw Cancelled; std::runtime_error if the others cannot be reached.
  virtual std::vector<std::string> all_gather(const std::string& mine) = 0;

  /// The same at the root; at the others, nothing. @throw as above.
  virtual std::vector<std::string> gather(const std::string& mine) = 0;

  /// Replaces bytes at all other ranks by those of the root; all have the same count. @throw as above.
  virtual void broadcast(void* bytes, std::size_t size) = 0;

  /// Replaces numbers at all ranks by their sums; all have the same count. @throw as above.
  virtual void sum(std::vector<std::uint64_t>& numbers) = 0;
};

/// In what follows, ranks may be null: this process is alone.
inline bool is_root(const Ranks* ranks) { return !ranks || ranks->rank() == 0; }
inline bool is_mine(const Ranks* ranks, std::size_t unit) { return !ranks || unit % ranks->count() == ranks->rank(); }

/// The root's value, at all ranks: a number, or a struct of them. @throw as Ranks::all_gather.
template <class Value>
Value broadcast(Ranks* ranks, Value value) {
  if (ranks) ranks->broadcast(&value, sizeof value);
  return value;
}

/// The root's list, at all ranks: a vector of such values, or a string. @throw as above.
template <class Values>
void broadcast_list(Ranks* ranks, Values& values) {
  if (!ranks) return;
  values.resize(broadcast(ranks, values.size()));
  ranks->broadcast(values.data(), values.size() * sizeof values[0]);
}

/// Gives the root what all others have, one after the other, so that it has the bytes of one at a time.
/// @param copy  At the others, copies what this rank has to an archive; at the root, takes it from there.
/// @throw as above; DamagedArchive.
inline void gather_in_turn(Ranks* ranks, const std::function<void(Archive& archive)>& copy) {
  for (std::size_t rank = 1; ranks && rank < ranks->count(); ++rank) {
    Archive mine;
    if (ranks->rank() == rank) copy(mine);
    const std::vector<std::string> given = ranks->gather(mine.take());
    if (!is_root(ranks)) continue;
    Archive archive(given.at(rank));
    copy(archive);
    archive.finish();
  }
}

}  // namespace tensorray
