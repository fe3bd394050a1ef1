// Ranks that are threads of this process: jobs and units are handed out, and come back.

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <numeric>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tools/ranks/follower.h"
#include "tools/ranks/leader.h"
#include "tools/ranks/rank_message.h"
#include "tools/ranks/ranks.h"

namespace tensorray {
namespace {

/// The messages on their way to each rank.
struct Post {
  std::mutex mutex;
  std::vector<std::deque<RankBytes>> boxes;
};

class ThreadRanks : public Ranks {
 public:
  ThreadRanks(Post& post, int rank) : post_(post), rank_(rank) {}

  int rank() const override { return rank_; }
  int count() const override { return static_cast<int>(post_.boxes.size()); }
  void send(int to, const std::string& bytes) override {
    const std::lock_guard lock(post_.mutex);
    post_.boxes[static_cast<std::size_t>(to)].push_back({rank_, bytes});
  }
  std::optional<RankBytes> receive() override {
    const std::lock_guard lock(post_.mutex);
    std::deque<RankBytes>& box = post_.boxes[static_cast<std::size_t>(rank_)];
    if (box.empty()) return std::nullopt;
    RankBytes message = std::move(box.front());
    box.pop_front();
    return message;
  }
  void finish() override {}

 private:
  Post& post_;
  const int rank_;
};

std::string state_of(std::size_t unit) { return std::string(10 + unit, static_cast<char>('a' + unit % 26)); }

/// Something that happens once, for which threads wait.
class Event {
 public:
  void happen() {
    const std::lock_guard lock(mutex_);
    has_happened_ = true;
    wake_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return has_happened_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  bool has_happened_ = false;
};

/// Called by each rank when it has got units, before it does them.
using OnUnits = std::function<void(int rank, const std::vector<std::size_t>& units)>;
/// Called by each rank when a unit is done.
using OnDone = std::function<void(int rank)>;

struct Watch {
  OnUnits on_units = [](int, const std::vector<std::size_t>&) {};
  OnDone on_done = [](int) {};
  std::function<void(Team& team)> first = [](Team&) {};  // Called by each rank before its units.
};

/// Does units as the path tracer does: each in two passes.
void do_units(Work& work, std::size_t units, int rank = 0, const Watch& watch = {}) {
  work.begin(units);
  while (!work.stopping) {
    const std::vector<std::size_t> next = work.next();
    if (next.empty()) break;
    watch.on_units(rank, next);
    for (const std::size_t unit : next) {
      const auto state = work.state(unit);
      const bool is_second = state && *state == "half";
      work.keep(unit, is_second ? state_of(unit) : "half", is_second);
      if (is_second) watch.on_done(rank);
    }
  }
}

struct Result {
  std::vector<WorkUnit> units;
  RankTraffic traffic;
};

/// All ranks do the units of a work. @param kept  Units of an earlier run.
Result share_work(int ranks, std::size_t units, std::vector<WorkUnit> kept = {}, const Watch& watch = {},
                  double interval = 0) {
  Post post;
  post.boxes.resize(static_cast<std::size_t>(ranks));
  Progress progress;
  std::vector<std::thread> others;
  for (int rank = 1; rank < ranks; ++rank)
    others.emplace_back([&, rank] {
      ThreadRanks mine(post, rank);
      Follower follower(mine, progress, interval);
      while (const auto job = follower.next_job()) {
        EXPECT_EQ(job->text, "the job");
        Work work;
        follower.share(*job, work, 2);
        watch.first(*follower.team(*job));
        do_units(work, units, rank, watch);
      }
    });
  ThreadRanks first(post, 0);
  Leader leader(first, progress);
  Work work({}, std::move(kept));
  watch.first(leader.share("the job", work, 2));
  do_units(work, units, 0, watch);
  leader.end();
  leader.finish();
  for (std::thread& each : others) each.join();
  return {work.units(), leader.traffic()};
}

void expect_complete(const std::vector<WorkUnit>& units, std::size_t count) {
  ASSERT_EQ(units.size(), count);
  for (std::size_t unit = 0; unit < count; ++unit) {
    EXPECT_TRUE(units[unit].done) << unit;
    EXPECT_EQ(*units[unit].state, state_of(unit)) << unit;
  }
}

TEST(SharedWork, AllUnitsAreDoneOnce) {
  for (const int ranks : {1, 2, 3, 4})
    for (const std::size_t units : {std::size_t{1}, std::size_t{7}, std::size_t{300}}) {
      const Result result = share_work(ranks, units);
      expect_complete(result.units, units);
      std::uint64_t done = 0;
      for (const std::uint64_t each : result.traffic.units) done += each;
      EXPECT_EQ(done, units) << ranks;
    }
}

/// A unit crosses once each way, with 24 bytes about it; requests are counted, too.
TEST(SharedWork, BytesAreThoseOfTheUnits) {
  constexpr std::size_t units = 200, head = 24;
  Event others_have_some;
  Watch watch;
  watch.on_units = [&](int rank, const std::vector<std::size_t>&) {
    rank == 0 ? others_have_some.wait() : others_have_some.happen();
  };
  const Result result = share_work(3, units, {}, watch);
  const std::uint64_t away = result.traffic.units[1] + result.traffic.units[2];
  EXPECT_GT(away, 0u);
  std::size_t states = 0;
  for (std::size_t unit = 0; unit < units; ++unit) states += state_of(unit).size();
  const std::uint64_t job = std::string("the job").size();
  // Each message has its head. Beside these there are states to rank 0, and the jobs from it.
  EXPECT_LE(result.traffic.bytes_received + result.traffic.bytes_sent,
            head * result.traffic.messages + states + 2 * job);
  EXPECT_GE(result.traffic.bytes_received + result.traffic.bytes_sent, head * result.traffic.messages + 10 * away);
  // Units of both ways, and a request with its answer for every two of them at most, and for the jobs and their ends.
  EXPECT_LE(result.traffic.messages, 2 * away + away + 2 * 2 * 4);
}

/// The last rank does its first units when the others have done all the rest.
TEST(SharedWork, ASlowRankDoesNotHoldTheOthers) {
  constexpr std::size_t units = 400;
  constexpr int slow = 3;
  Event slow_has_some, rest_is_done;
  std::atomic<std::size_t> held{0}, done{0};
  const auto look = [&] {
    if (held > 0 && held + done == units) rest_is_done.happen();
  };
  Watch watch;
  watch.on_units = [&](int rank, const std::vector<std::size_t>& mine) {
    if (rank != slow) return slow_has_some.wait();
    if (held > 0) return;  // Their second pass.
    held = mine.size();
    slow_has_some.happen();
    look();
    rest_is_done.wait();
  };
  watch.on_done = [&](int rank) {
    if (rank == slow) return;
    ++done;
    look();
  };
  const Result result = share_work(4, units, {}, watch);
  expect_complete(result.units, units);
  EXPECT_EQ(result.traffic.units[slow], held);
  EXPECT_LT(held, units / 4);
}

TEST(SharedWork, ContinuesWithUnitsOfAnEarlierRun) {
  std::vector<WorkUnit> kept(50);
  for (std::size_t unit = 0; unit < kept.size(); unit += 2)
    kept[unit] = {std::make_shared<const std::string>(unit % 4 == 0 ? "half" : state_of(unit)), unit % 4 != 0};
  const Result result = share_work(3, kept.size(), kept);
  expect_complete(result.units, kept.size());
  std::uint64_t done = 0;
  for (const std::uint64_t each : result.traffic.units) done += each;
  EXPECT_EQ(done, 38u);  // 12 were done before.
}

/// Rank 0 gets units that are not done, so that a checkpoint has them.
TEST(SharedWork, UnitsThatAreNotDoneAreSentAfterTheInterval) {
  constexpr double at_once = 1e-12;
  for (const double interval : {at_once, 0.0}) {
    Event other_has_some;
    Watch watch;
    watch.on_units = [&](int rank, const std::vector<std::size_t>&) {
      rank == 0 ? other_has_some.wait() : other_has_some.happen();
    };
    const Result result = share_work(2, 40, {}, watch, interval);
    expect_complete(result.units, 40);
    const std::uint64_t away = result.traffic.units[1];
    ASSERT_GT(away, 0u);
    // Each unit comes, is sent back when it is done, and before that as half.
    EXPECT_GE(result.traffic.messages, (interval > 0 ? 3 : 2) * away);
    if (interval == 0) {
      EXPECT_LT(result.traffic.messages, 3 * away + 8);  // And requests: one for two units, and for the end.
    }
  }
}

TEST(SharedWork, WholeJobsAreDoneOnceByAnyRank) {
  Post post;
  post.boxes.resize(3);
  Progress progress;
  std::mutex mutex;
  std::vector<std::string> done;
  const auto note = [&](const std::string& job) {
    const std::lock_guard lock(mutex);
    done.push_back(job);
  };
  std::vector<std::thread> others;
  Event others_have_some;
  for (int rank = 1; rank < 3; ++rank)
    others.emplace_back([&, rank] {
      ThreadRanks mine(post, rank);
      Follower follower(mine, progress, 0);
      while (const auto job = follower.next_job()) {
        note(job->text);
        others_have_some.happen();
      }
    });
  ThreadRanks first(post, 0);
  Leader leader(first, progress);
  std::deque<std::string> jobs;
  for (int i = 0; i < 30; ++i) jobs.push_back(std::to_string(i));
  const std::set<std::string> all(jobs.begin(), jobs.end());
  leader.offer(jobs);
  others_have_some.wait();
  while (const auto job = leader.take()) note(*job);
  leader.finish();
  for (std::thread& each : others) each.join();
  EXPECT_EQ(done.size(), 30u);
  EXPECT_EQ(std::set<std::string>(done.begin(), done.end()), all);
}

/// What each rank has after some steps: in every step the parts of all, one after the other; and what rank 0 collects.
std::vector<std::string> do_steps(Team& team, int steps) {
  std::vector<std::string> seen;
  for (int step = 0; step < steps; ++step) {
    // Parts of any size, also empty ones.
    const auto letter = static_cast<char>('a' + step);
    const std::string mine(team.index() * static_cast<std::size_t>(step), letter);
    std::string all;
    for (const std::string& part : team.exchange(mine)) all += part + '|';
    seen.push_back(all);
    const std::vector<std::string> parts = team.collect(mine + std::to_string(team.index()));
    EXPECT_EQ(parts.size(), team.index() == 0 ? team.count() : 0u);
    for (std::size_t i = 0; i < parts.size(); ++i)
      EXPECT_EQ(parts[i], std::string(i * static_cast<std::size_t>(step), letter) + std::to_string(i));
  }
  return seen;
}

TEST(SharedSteps, WhatIsPassedOnReachesEachRankOnce) {
  for (int count = 1; count < 70; ++count) {
    std::vector<int> reached{0};
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const std::vector<int> next = next_ranks(reached[i], count);
      EXPECT_LT(1 << next.size(), 2 * count);
      reached.insert(reached.end(), next.begin(), next.end());
    }
    std::sort(reached.begin(), reached.end());
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(reached, all);
  }
}

TEST(SharedSteps, AllRanksHaveThePartsOfAll) {
  for (const int ranks : {2, 3, 4, 7}) {
    Post post;
    post.boxes.resize(static_cast<std::size_t>(ranks));
    Progress progress;
    std::vector<std::vector<std::string>> seen(static_cast<std::size_t>(ranks));
    std::vector<std::thread> others;
    for (int rank = 1; rank < ranks; ++rank)
      others.emplace_back([&, rank] {
        ThreadRanks mine(post, rank);
        Follower follower(mine, progress, 0);
        for (int jobs = 0; const auto job = follower.next_job(); ++jobs) {
          const auto team = follower.team(*job);
          EXPECT_EQ(job->text, jobs == 0 ? "the job" : "another job");
          seen[static_cast<std::size_t>(rank)] = do_steps(*team, 5);
        }
      });
    ThreadRanks first(post, 0);
    Leader leader(first, progress);
    for (const char* job : {"the job", "another job"}) {
      seen[0] = do_steps(leader.share_steps(job), 5);
      leader.end();
    }
    leader.finish();
    for (std::thread& each : others) each.join();
    std::string expected;
    for (int rank = 0; rank < ranks; ++rank) expected += std::string(static_cast<std::size_t>(3 * rank), 'd') + '|';
    EXPECT_EQ(seen[0][3], expected);
    for (const auto& each : seen) EXPECT_EQ(each, seen[0]);
  }
}

/// A job may have steps before its units. A unit is counted where it is done, and steps are not.
TEST(SharedSteps, ComeBeforeUnits) {
  for (const int ranks : {2, 3}) {
    Watch watch;
    watch.first = [](Team& team) { do_steps(team, 3); };
    const Result result = share_work(ranks, 20, {}, watch);
    expect_complete(result.units, 20);
    const std::vector<std::uint64_t>& units = result.traffic.units;
    EXPECT_EQ(std::accumulate(units.begin(), units.end(), std::uint64_t{0}), 20u);
  }
}

TEST(SharedSteps, ADamagedMessageIsRefused) {
  const std::string bytes = packed({"one", "", "three"});
  EXPECT_EQ(unpacked(bytes, 3), (std::vector<std::string>{"one", "", "three"}));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(unpacked(bytes.substr(0, size), 3), std::runtime_error) << size;
}

TEST(SharedSteps, CancelledRanksDoNotWait) {
  Post post;
  post.boxes.resize(2);
  Progress progress;
  ThreadRanks first(post, 0);
  Leader leader(first, progress);
  Team& team = leader.share_steps("the job");
  progress.cancelled = true;
  EXPECT_THROW(team.exchange("mine"), Cancelled);
  EXPECT_THROW(team.collect("mine"), Cancelled);
}

TEST(SharedWork, CancelledRanksStop) {
  Post post;
  post.boxes.resize(2);
  Progress progress;
  progress.cancelled = true;
  ThreadRanks mine(post, 1), first(post, 0);
  Follower follower(mine, progress, 0);
  EXPECT_THROW(follower.next_job(), Cancelled);
  Leader leader(first, progress);
  Work work;
  leader.share("the job", work, 2);
  do_units(work, 10);
  EXPECT_TRUE(work.stopping);
  leader.end();
  EXPECT_THROW(leader.finish(), Cancelled);
}

}  // namespace
}  // namespace tensorray
