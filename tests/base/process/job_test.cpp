#include "base/process/job.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "tests/base/rank_support.h"

namespace tensorray {
namespace {

using namespace test;

TEST(ArchiveTest, GivesBackWhatItWasGiven) {
  using Values = std::tuple<std::vector<int>, double, std::string, std::vector<int>>;
  const auto copy = [](Archive& archive, Values& values) {
    auto& [numbers, number, text, none] = values;
    archive.copy_list(numbers);
    archive.copy(number);
    archive.copy_list(text);
    archive.copy_list(none);
  };
  Values given{{1, 2, 3}, 0.1, "text", {}}, found{{}, 0, "", {7}};
  Archive to;
  copy(to, given);
  const std::string bytes = to.take();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    Archive cut(std::string_view(bytes).substr(0, size));
    EXPECT_THROW(copy(cut, found), DamagedArchive) << size;
  }
  Archive from(bytes);
  EXPECT_THROW(from.finish(), DamagedArchive);
  copy(from, found);
  from.finish();
  EXPECT_EQ(found, given);
}

/// A count that no bytes follow asks for no memory.
TEST(ArchiveTest, HasMemoryOnlyForWhatIsThere) {
  for (std::size_t count : {~std::size_t{0}, ~std::size_t{0} / 8, std::size_t{3}}) {
    Archive to;
    to.copy(count);
    const std::string bytes = to.take() + std::string(16, 'x');
    std::vector<double> values;
    Archive from(bytes);
    EXPECT_THROW(from.copy_list(values), DamagedArchive);
    EXPECT_TRUE(values.empty());
  }
}

constexpr std::size_t unit_count = 37;

struct Made {
  std::vector<std::size_t> values = std::vector<std::size_t>(unit_count);
  std::atomic<std::size_t> made{0};
};

/// Units whose results are squares.
void make_squares(Made& made, Job* job, bool for_all = false, const Progress& progress = {}) {
  Units units;
  units.count = unit_count;
  units.kind = "square";
  units.round = 10;
  units.for_all = for_all;
  units.make = [&](std::size_t i) {
    made.values[i] = i * i;
    ++made.made;
  };
  units.copy = [&](std::size_t i, Archive& archive) { archive.copy(made.values[i]); };
  make_units(units, job, "squaring", progress);
}

std::vector<std::size_t> squares() {
  Made made;
  make_squares(made, nullptr);
  return made.values;
}

TEST(JobTest, RanksMakeEachUnitOnce) {
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{40}})
    for (const bool for_all : {true, false}) {
      std::vector<Made> made(count);
      std::size_t kept = 0;
      run_ranks(count, [&](Ranks& ranks) {
        Job job;
        job.ranks = &ranks;
        make_squares(made[ranks.rank()], &job, for_all);
        if (is_root(&ranks)) kept = job.results().size();
      });
      std::size_t all = 0;
      for (const Made& each : made) all += each.made;
      EXPECT_EQ(all, unit_count);
      EXPECT_EQ(kept, unit_count);
      for (std::size_t rank = 0; rank < (for_all ? count : 1); ++rank) EXPECT_EQ(made[rank].values, squares());
    }
}

TEST(JobTest, ShardsMergeAndRunsContinue) {
  Results all;
  for (std::size_t index = 0; index < 3; ++index) {
    Job shard({index, 3});
    shard.is_shard = true;
    Made made;
    make_squares(made, &shard);
    EXPECT_LE(made.made, unit_count / 3 + 1);
    const Results some = shard.results();
    all.insert(some.begin(), some.end());
  }
  Job merged({0, 3}, all);
  Made made;
  make_squares(made, &merged);
  EXPECT_EQ(made.made, 0u);
  EXPECT_EQ(made.values, squares());
  all.erase("square 5");
  run_ranks(2, [&](Ranks& ranks) {
    Job resumed({}, all);
    resumed.ranks = &ranks;
    Made rest;
    make_squares(rest, &resumed, true);
    EXPECT_EQ(rest.made, ranks.rank() == 1 ? 1u : 0u);
    EXPECT_EQ(rest.values, squares());
  });
  Job damaged({}, {{"square 5", std::make_shared<const std::string>("short")}});
  EXPECT_THROW(make_squares(made, &damaged), DamagedArchive);
  StrangeRanks strange;
  Job other;
  other.ranks = &strange;
  EXPECT_THROW(make_squares(made, &other), DamagedArchive);
}

/// A run that is cancelled has the rounds before.
TEST(JobTest, ACancelledRunKeepsItsRounds) {
  Job job;
  Progress progress;
  progress.report = [&](const std::string&, std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(total, unit_count);
    if (done > 20) progress.cancelled = true;
  };
  Made made;
  EXPECT_THROW(make_squares(made, &job, false, progress), Cancelled);
  EXPECT_GE(job.results().size(), 20u);
  EXPECT_LT(job.results().size(), unit_count);
}

/// A result is made once, by the first run that is long enough.
TEST(JobTest, ResultsAreFoundOrMade) {
  int made = 0;
  std::vector<int> values;
  const auto find = [&](Job& job) {
    values.clear();
    find_or_make(
        &job, "values",
        [&] {
          values.assign(3, 7);
          std::this_thread::sleep_for(std::chrono::milliseconds(1));  // Worth a thousand bytes.
          ++made;
        },
        [&](Archive& archive) { archive.copy_list(values); });
    EXPECT_EQ(values, std::vector<int>(3, 7));
  };
  Job quick, slow;  // Without an interval nothing is kept.
  find(quick);
  EXPECT_TRUE(quick.results().empty());
  slow.interval = 1e-9;
  find(slow);
  Job resumed({}, slow.results());
  find(resumed);
  EXPECT_EQ(made, 2);
  Job damaged({}, {{"values", std::make_shared<const std::string>(32, 'x')}});
  EXPECT_THROW(find(damaged), DamagedArchive);
}

TEST(ArchiveTest, PacksWhatResemblesItself) {
  struct Item {
    double value;
    int count, more;
  };
  std::vector<Item> items(1000), found(1000);
  for (int i = 0; i < 1000; ++i) items[static_cast<std::size_t>(i)] = {std::sqrt(i), 7, i / 100};
  Archive archive;
  archive.copy_packed(items.data(), items.size(), sizeof(Item));
  std::string bytes = archive.take();
  EXPECT_LT(bytes.size(), items.size() * 9);
  Archive back(bytes);
  back.copy_packed(found.data(), found.size(), sizeof(Item));
  back.finish();
  EXPECT_EQ(std::memcmp(items.data(), found.data(), items.size() * sizeof(Item)), 0);
  bytes[bytes.size() / 2] ^= 1;
  for (const std::string& damaged : {bytes, bytes.substr(0, 100), std::string(8, 0)}) {
    Archive wrong(damaged);
    EXPECT_THROW(wrong.copy_packed(found.data(), found.size(), sizeof(Item)), DamagedArchive);
  }
}

}  // namespace
}  // namespace tensorray
