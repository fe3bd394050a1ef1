#pragma once
/// @file tools/ranks/leader.h
/// What rank 0 does for the others: it hands out jobs, and units of them, in small numbers, so that a slow rank does
/// not hold the others, and takes the units that are done. It renders, too.

#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/process/progress.h"
#include "base/process/team.h"
#include "base/process/work.h"
#include "tools/ranks/rank_message.h"
#include "tools/ranks/ranks.h"

namespace tensorray {

/// What the ranks have sent each other.
struct RankTraffic {
  std::uint64_t messages = 0, bytes_sent = 0, bytes_received = 0;  ///< By rank 0; numbers of messages of both ways.
  std::vector<std::uint64_t> units;                                ///< The units that each rank has done.
};

/// Work that all ranks do: units, or steps.
struct SharedJob {
  std::uint32_t number = 0;
  std::string text;
  Work* work = nullptr;                              ///< Null: steps.
  std::map<int, std::deque<std::string>> parts;      ///< Of the next steps, by the other ranks.
  std::size_t next = 0;                              ///< The units before it were handed out.
  std::size_t away = 0;                              ///< Units that other ranks have.
  std::vector<std::size_t> mine;                     ///< Units that this rank has.
  std::vector<std::pair<int, std::size_t>> waiting;  ///< Ranks that need units, and their threads, before it begins.
};

/// A thread of it uses `ranks`; nobody else may, before `finish`.
class Leader : private Team {
 public:
  /// Both must outlive it.
  Leader(Ranks& ranks, const Progress& progress);
  ~Leader() override;
  Leader(const Leader&) = delete;
  Leader& operator=(const Leader&) = delete;

  /// All ranks do units of `work` from now on, this one with `threads` threads, until all are done. Before it
  /// begins, they may do steps together. The work ends early when the progress is cancelled. @param job  What the
  /// others need to begin. Ends with `end`. @return of this rank, for the steps.
  Team& share(const std::string& job, Work& work, std::size_t threads);

  /// All ranks do the steps of the job together from now on. Ends with `end`. @param job  As above. @return of this
  /// rank, which must not be used after `end`.
  Team& share_steps(const std::string& job);

  /// No rank uses the work of `share`, nor the team, from now on.
  void end();

  /// Jobs that one rank each does by itself, whichever has time.
  void offer(std::deque<std::string> jobs);

  /// One of them, for this rank; nothing: there are none left.
  std::optional<std::string> take();

  /// Waits until all ranks have done what they have, and ends them. @throw Cancelled.
  void finish();

  RankTraffic traffic() const;

 private:
  std::size_t index() const override { return 0; }
  std::size_t count() const override { return given_.size(); }
  std::vector<std::string> exchange(std::string mine) override { return do_step(std::move(mine), true); }
  std::vector<std::string> collect(std::string mine) override { return do_step(std::move(mine), false); }

  void run();
  void rethrow() const;
  void receive(int from, RankMessage message);
  void answer();
  void send(int to, const RankMessage& message);
  bool has_begun() const { return shared_->work && shared_->work->size() > 0; }
  bool has_units() const { return !has_begun() || shared_->next < shared_->work->size(); }
  std::optional<std::vector<std::string>> take_parts();
  std::vector<std::string> do_step(std::string mine, bool gives_back);
  std::vector<std::size_t> take_units(std::size_t threads);
  void send_units(int to, std::uint32_t job, std::size_t threads);
  std::vector<std::size_t> next_units(std::size_t threads);

  Ranks& ranks_;
  const Progress& progress_;
  mutable std::mutex mutex_;  ///< For all that follows.
  RankTraffic traffic_;
  std::uint32_t jobs_ = 0;  ///< The number of jobs so far.
  std::optional<SharedJob> shared_;
  std::deque<std::string> offered_;
  std::set<int> idle_;                ///< Ranks that wait for a job.
  std::vector<std::uint32_t> given_;  ///< The last job of each rank.
  int finished_ = 0;                  ///< Ranks that were told that there are no more jobs.
  bool is_finishing_ = false, ends_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace tensorray
