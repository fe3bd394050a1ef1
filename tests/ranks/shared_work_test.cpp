// Ranks that are threads of this process: jobs and units are handed out, and come back.

#include <atomic>
#include <chrono>
#include <deque>
#include <mutex>
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

/// Does units as the path tracer does: each in two passes. @param slow  A pause after each unit, in milliseconds.
void do_units(Work& work, std::size_t units, int slow) {
  work.begin(units);
  while (!work.stopping) {
    const std::vector<std::size_t> next = work.next();
    if (next.empty()) break;
    for (const std::size_t unit : next) {
      const auto state = work.state(unit);
      const bool is_second = state && *state == "half";
      work.keep(unit, is_second ? state_of(unit) : "half", is_second);
      if (slow > 0) std::this_thread::sleep_for(std::chrono::milliseconds(slow));
    }
  }
}

struct Result {
  std::vector<WorkUnit> units;
  RankTraffic traffic;
};

/// All ranks do the units of a work. @param kept  Units of an earlier run. @param slow  Pause of the last rank.
Result share_work(int ranks, std::size_t units, std::vector<WorkUnit> kept = {}, int slow = 0, double interval = 0) {
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
        do_units(work, units, rank == ranks - 1 ? slow : 0);
      }
    });
  ThreadRanks first(post, 0);
  Leader leader(first, progress);
  Work work({}, std::move(kept));
  leader.share("the job", work, 2);
  do_units(work, units, ranks > 1 ? 1 : 0);  // Leaves some to the others.
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
  const Result result = share_work(3, units);
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

TEST(SharedWork, ASlowRankDoesNotHoldTheOthers) {
  const Result result = share_work(4, 400, {}, 20);
  expect_complete(result.units, 400);
  EXPECT_LT(result.traffic.units[3], result.traffic.units[2] / 2);
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
  const Result often = share_work(2, 40, {}, 5, 1e-3);
  expect_complete(often.units, 40);
  const Result never = share_work(2, 40, {}, 5);
  const auto per_unit = [](const Result& result) {
    return static_cast<double>(result.traffic.messages) / static_cast<double>(result.traffic.units[1]);
  };
  EXPECT_GT(per_unit(often), per_unit(never));
}

TEST(SharedWork, WholeJobsAreDoneOnceByAnyRank) {
  Post post;
  post.boxes.resize(3);
  Progress progress;
  std::mutex mutex;
  std::vector<std::string> done;
  const auto note = [&](const std::string& job) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    const std::lock_guard lock(mutex);
    done.push_back(job);
  };
  std::vector<std::thread> others;
  std::atomic<int> by_others{0};
  for (int rank = 1; rank < 3; ++rank)
    others.emplace_back([&, rank] {
      ThreadRanks mine(post, rank);
      Follower follower(mine, progress, 0);
      while (const auto job = follower.next_job()) {
        note(job->text);
        ++by_others;
      }
    });
  ThreadRanks first(post, 0);
  Leader leader(first, progress);
  std::deque<std::string> jobs;
  for (int i = 0; i < 30; ++i) jobs.push_back(std::to_string(i));
  const std::set<std::string> all(jobs.begin(), jobs.end());
  leader.offer(jobs);
  while (const auto job = leader.take()) note(*job);
  leader.finish();
  for (std::thread& each : others) each.join();
  EXPECT_EQ(done.size(), 30u);
  EXPECT_EQ(std::set<std::string>(done.begin(), done.end()), all);
  EXPECT_GT(by_others, 0);
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
  do_units(work, 10, 0);
  EXPECT_TRUE(work.stopping);
  leader.end();
  EXPECT_THROW(leader.finish(), Cancelled);
}

}  // namespace
}  // namespace tensorray
