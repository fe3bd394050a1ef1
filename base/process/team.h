#pragma once
/// @file base/process/team.h
/// Processes that compute the same thing together.

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tensorray {

/// This process among those that compute the same thing, step by step. In each step a process does its part, and gives
/// it to the others before the next one begins. All processes call the same functions in the same order; one thread of
/// each at a time.
class Team {
 public:
  virtual ~Team() = default;

  virtual std::size_t index() const = 0;  ///< Of this process, from 0 on.
  virtual std::size_t count() const = 0;  ///< Number of processes.

  /// Gives all others what this process has done, and waits for what they have done. @return by process. @throw
  /// Cancelled; std::runtime_error if the others cannot be reached.
  virtual std::vector<std::string> exchange(std::string mine) = 0;

  /// Gives it to process 0 alone. @return by process; at all others, nothing. @throw as above.
  virtual std::vector<std::string> collect(std::string mine) = 0;
};

/// Whether this process does a part of a step: every `count`-th one. @param team  Null: it is alone.
inline bool does_part(const Team* team, std::size_t part) { return !team || part % team->count() == team->index(); }

/// Whether this process has what `collect` gives.
inline bool has_all(const Team* team) { return !team || team->index() == 0; }

/// What a process gives another: values that are copied to bytes there, and from bytes here.
class PartBytes {
 public:
  PartBytes() = default;                                                           ///< Copies to bytes.
  explicit PartBytes(std::string from) : bytes_(std::move(from)), reads_(true) {}  ///< Copies from these.

  /// @throw std::runtime_error if there are not so many bytes.
  void copy(void* values, std::size_t size);

  /// Copies numbers, or structs of them, and how many there are. @throw as `copy`.
  template <class Value>
  void copy_vector(std::vector<Value>& values) {
    std::size_t count = values.size();
    copy(&count, sizeof count);
    values.resize(reads_ ? there_are(count, sizeof(Value)) : count);
    copy(values.data(), count * sizeof(Value));
  }

  bool reads() const { return reads_; }
  bool ends() const { return at_ == bytes_.size(); }  ///< Whether all bytes have been copied from.
  std::string take() { return std::move(bytes_); }

 private:
  /// The count. @throw as `copy` if there are not so many values of so many bytes: before there is memory for them.
  std::size_t there_are(std::size_t count, std::size_t size) const;

  std::string bytes_;
  std::size_t at_ = 0;
  bool reads_ = false;
};

/// Copies a part of a step to or from bytes.
using CopyPart = std::function<void(std::size_t part, PartBytes& bytes)>;

/// Gives all others the parts that this process has done (does_part), and takes theirs. @param at_once  Parts of all
/// processes that cross together. @throw as Team::exchange; std::runtime_error if the others have other parts.
void exchange_parts(Team& team, std::size_t parts, std::size_t at_once, const CopyPart& copy);

/// A number of process 0, at all processes. @param team  Null: this process is alone. @throw as Team::exchange.
template <class Number>
Number of_first(Team* team, Number number) {
  if (team) exchange_parts(*team, 1, 1, [&](std::size_t, PartBytes& bytes) { bytes.copy(&number, sizeof number); });
  return number;
}

/// Copies bytes of process 0 to all processes, which have room for as many. @throw as Team::exchange.
void copy_of_first(Team& team, void* values, std::size_t size);

/// Gives all processes the values of process 0 instead of theirs: a vector of numbers, or of structs of them, or a
/// string. @throw as Team::exchange.
template <class Values>
void share_values(Team& team, Values& values) {
  values.resize(of_first(&team, values.size()));
  copy_of_first(team, values.data(), values.size() * sizeof values[0]);
}

/// Gives process 0 the parts that this process has done. @param at_once, @throw as above.
void collect_parts(Team& team, std::size_t parts, std::size_t at_once, const CopyPart& copy);

}  // namespace tensorray
