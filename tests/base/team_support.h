#pragma once
/// @file tests/base/team_support.h
/// Teams whose members are threads.

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/process/team.h"

namespace tensorray::test {

/// What the members of a team give each other. All wait until all have given it.
struct Table {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> parts, given;
  std::size_t waiting = 0, rounds = 0, bytes = 0;
};

class ThreadTeam : public Team {
 public:
  ThreadTeam(Table& table, std::size_t index) : table_(table), index_(index) {}

  std::size_t index() const override { return index_; }
  std::size_t count() const override { return table_.parts.size(); }

  std::vector<std::string> exchange(std::string mine) override {
    std::unique_lock lock(table_.mutex);
    table_.bytes += mine.size();
    table_.parts[index_] = std::move(mine);
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

  std::vector<std::string> collect(std::string mine) override {
    std::vector<std::string> parts = exchange(std::move(mine));
    return index_ == 0 ? parts : std::vector<std::string>();
  }

 private:
  Table& table_;
  const std::size_t index_;
};

/// Calls `work` for each member of a team, in threads. @return the bytes that they have given each other.
inline std::size_t run_team(std::size_t count, const std::function<void(Team& team)>& work) {
  Table table;
  table.parts.resize(count);
  std::vector<std::thread> members;
  for (std::size_t index = 0; index < count; ++index)
    members.emplace_back([&, index] {
      ThreadTeam team(table, index);
      work(team);
    });
  for (std::thread& each : members) each.join();
  return table.bytes;
}

/// Of a member that is another program, say.
class StrangeTeam : public Team {
 public:
  std::size_t index() const override { return 0; }
  std::size_t count() const override { return 2; }
  std::vector<std::string> exchange(std::string mine) override { return {mine, "strange"}; }
  std::vector<std::string> collect(std::string mine) override { return {mine, "strange"}; }
};

}  // namespace tensorray::test
