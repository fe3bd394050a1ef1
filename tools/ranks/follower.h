#pragma once
/// @file tools/ranks/follower.h
/// What all ranks but 0 do: they ask rank 0 for jobs, and for units of them.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/process/progress.h"
#include "base/process/team.h"
#include "base/process/work.h"
#include "tools/ranks/ranks.h"

namespace tensorray {

struct RankJob {
  std::uint32_t number = 0;
  std::string text;
};

class Follower {
 public:
  /// @param interval  Seconds after which units that are not done are sent again, so that rank 0 can keep them; 0: only
  ///                  units that are done. Both must outlive it.
  Follower(Ranks& ranks, const Progress& progress, double interval);

  /// Waits for what to do next; nothing: the end. @throw Cancelled.
  std::optional<RankJob> next_job();

  /// This rank in the team that does the steps of the job. It uses the follower.
  std::unique_ptr<Team> team(const RankJob& job);

  /// Makes `work` ask rank 0 for its units, and send them there. @param threads  Of this process.
  void share(const RankJob& job, Work& work, std::size_t threads);

 private:
  std::vector<std::size_t> next_units(std::uint32_t job, Work& work, std::size_t threads);
  std::string wait() const;

  class StepTeam;

  Ranks& ranks_;
  const Progress& progress_;
  const double interval_;
};

}  // namespace tensorray
