#pragma once
/// Ranks that are threads.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "base/process/ranks.h"

namespace tensorray::test {

/// What the ranks give each other. All wait until all have given it.
struct Table {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> parts, given;
  std::size_t waiting = 0, rounds = 0;
};

class ThreadRanks : public Ranks {
 public:
  ThreadRanks(Table& table, std::size_t rank) : table_(table), rank_(rank) {}

  std::size_t rank() const override { return rank_; }
  std::size_t count() const override { return table_.parts.size(); }

  std::vector<std::string> all_gather(const std::string& mine) override {
    std::unique_lock lock(table_.mutex);
    table_.parts[rank_] = mine;
    const std::size_t round = table_.rounds;
    if (++table_.waiting == count()) {
      table_.given = table_.parts;
      table_.waiting = 0;
      ++table_.rounds;
      table_.changed.notify_all();
    }
    table_.changed.wait(lock, [&] { return table_.rounds > round; });
    return table_.given;
  }

  std::vector<std::string> gather(const std::string& mine) override {
    std::vector<std::string> parts = all_gather(mine);
    return rank_ == 0 ? parts : std::vector<std::string>();
  }

  void broadcast(void* bytes, std::size_t size) override {
    const std::string root = all_gather(rank_ == 0 ? std::string(static_cast<char*>(bytes), size) : "").front();
    if (root.size() != size) throw std::length_error("ranks broadcast other counts");
    if (size > 0) std::memcpy(bytes, root.data(), size);
  }

  void sum(std::vector<std::uint64_t>& numbers) override {
    Archive mine;
    mine.copy_sums(numbers.data(), numbers.size());
    numbers.assign(numbers.size(), 0);
    for (const std::string& given : all_gather(mine.take())) Archive(given).copy_sums(numbers.data(), numbers.size());
  }

 private:
  Table& table_;
  const std::size_t rank_;
};

/// Calls `work` for each rank, in threads.
inline void run_ranks(std::size_t count, const std::function<void(Ranks& ranks)>& work) {
  Table table;
  table.parts.resize(count);
  std::vector<std::thread> threads;
  for (std::size_t rank = 0; rank < count; ++rank)
    threads.emplace_back([&, rank] {
      ThreadRanks ranks(table, rank);
      work(ranks);
    });
  for (std::thread& each : threads) each.join();
}

/// One of two ranks, of which the other one is another program, say.
class StrangeRanks : public Ranks {
 public:
  std::size_t rank() const override { return 0; }
  std::size_t count() const override { return 2; }
  std::vector<std::string> all_gather(const std::string& mine) override { return {mine, "strange"}; }
  std::vector<std::string> gather(const std::string& mine) override { return {mine, "strange"}; }
  void broadcast(void*, std::size_t) override {}
  void sum(std::vector<std::uint64_t>&) override {}
};

}  // namespace tensorray::test
