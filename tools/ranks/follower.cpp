#include "tools/ranks/follower.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "base/process/seconds.h"
#include "tools/ranks/rank_message.h"

namespace tensorray {
namespace {

constexpr std::chrono::milliseconds pause(1);

/// The units that this rank has and that are not done.
struct Mine {
  std::vector<std::size_t> units;
  Clock::time_point sent = Clock::now();
};

}  // namespace

Follower::Follower(Ranks& ranks, const Progress& progress, double interval)
    : ranks_(ranks), progress_(progress), interval_(interval) {}

std::string Follower::wait() const {
  for (;;) {
    if (progress_.cancelled) throw Cancelled();
    if (auto message = ranks_.receive()) return std::move(message->bytes);
    std::this_thread::sleep_for(pause);
  }
}

std::optional<RankJob> Follower::next_job() {
  ranks_.send(0, bytes_of({RankWord::job, 0, 0, 0, {}}));
  RankMessage answer = rank_message(wait());
  if (answer.word == RankWord::finish) return std::nullopt;
  return RankJob{answer.job, std::move(answer.bytes)};
}

class Follower::StepTeam : public Team {
 public:
  StepTeam(Follower& follower, std::uint32_t job) : follower_(follower), job_(job) {}

  std::size_t index() const override { return static_cast<std::size_t>(follower_.ranks_.rank()); }
  std::size_t count() const override { return static_cast<std::size_t>(follower_.ranks_.count()); }

  std::vector<std::string> exchange(std::string mine) override {
    follower_.ranks_.send(0, bytes_of({RankWord::part, job_, 0, 0, std::move(mine)}));
    const std::string all = follower_.wait();
    for (const int rank : next_ranks(follower_.ranks_.rank(), follower_.ranks_.count()))
      follower_.ranks_.send(rank, all);
    return unpacked(rank_message(all).bytes, count());
  }

  std::vector<std::string> collect(std::string mine) override {
    follower_.ranks_.send(0, bytes_of({RankWord::part, job_, 0, 0, std::move(mine)}));
    return {};
  }

 private:
  Follower& follower_;
  const std::uint32_t job_;
};

std::unique_ptr<Team> Follower::team(const RankJob& job) { return std::make_unique<StepTeam>(*this, job.number); }

std::vector<std::size_t> Follower::next_units(std::uint32_t job, Work& work, std::size_t threads) {
  ranks_.send(0, bytes_of({RankWord::more, job, threads, 0, {}}));
  std::vector<std::size_t> units;
  for (;;) {
    RankMessage answer = rank_message(wait());
    if (answer.word == RankWord::more) return units;
    units.push_back(answer.number);
    if (!answer.bytes.empty()) work.keep(answer.number, std::move(answer.bytes), false);
  }
}

void Follower::share(const RankJob& job, Work& work, std::size_t threads) {
  work.next = [this, &work, number = job.number, threads, mine = std::make_shared<Mine>()] {
    const bool is_due = interval_ > 0 && seconds_since(mine->sent) > interval_ / 2;
    std::vector<std::size_t> left;
    for (const std::size_t unit : mine->units) {
      const bool is_done = !work.wants(unit);
      if (!is_done) left.push_back(unit);
      const auto state = work.state(unit);
      if (state && (is_done || is_due))
        ranks_.send(0, bytes_of({RankWord::unit, number, unit, is_done ? 1u : 0u, *state}));
    }
    if (is_due) mine->sent = Clock::now();
    mine->units = left.empty() ? next_units(number, work, threads) : left;
    return mine->units;
  };
}

}  // namespace tensorray
