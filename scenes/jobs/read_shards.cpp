#include "scenes/jobs/read_shards.h"

#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "base/text/text.h"
#include "scenes/jobs/origin.h"

namespace tensorray {
namespace {

/// Adds the units of a shard to those of the others.
void unite(const std::string& file, WorkFile shard, WorkFile& all) {
  const auto fail = [&](const std::string& what) { throw std::invalid_argument(printable(file + ": " + what)); };
  const std::string other = difference(shard.origin, all.origin);
  if (!other.empty()) fail("is of another render than the first shard: " + other);
  if (shard.part.count != all.part.count)
    fail(fmt::format("is one of {} shards, the first one of {}", shard.part.count, all.part.count));
  if (shard.units.size() != all.units.size()) fail("has another number of units than the first shard");
  for (std::size_t i = shard.part.index; i < shard.units.size(); i += shard.part.count) {
    if (!shard.units[i].done)
      fail(fmt::format("is not complete; continue it with --shard {}/{} --resume", shard.part.index + 1,
                       shard.part.count));
    all.units[i] = std::move(shard.units[i]);
  }
  if (!all.before.state) all.before = std::move(shard.before);
}

}  // namespace

WorkFile read_shards(const std::vector<std::string>& files) {
  WorkFile all;
  std::map<std::size_t, std::string> names;
  for (const std::string& file : files) {
    WorkFile shard = read_work(file);
    if (names.empty()) {
      all = shard;
      all.units.assign(shard.units.size(), {});
    }
    const std::size_t index = shard.part.index;
    unite(file, std::move(shard), all);
    const auto [before, is_new] = names.emplace(index, file);
    if (!is_new)
      throw std::invalid_argument(printable(fmt::format("{} and {} are both shard {}/{}; name one of them",
                                                        before->second, file, index + 1, all.part.count)));
  }
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < all.part.count; ++i)
    if (names.count(i) == 0) missing.push_back(fmt::format("{}/{}", i + 1, all.part.count));
  if (!missing.empty())
    throw std::invalid_argument(fmt::format("missing {} {}: render with --shard, and name all files",
                                            missing.size() > 1 ? "shards" : "shard", joined(missing)));
  return all;
}

}  // namespace tensorray
