#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "base/text/text.h"
#include "scenes/jobs/origin.h"
#include "scenes/jobs/work_file.h"

namespace tensorray {
namespace {

/// Adds the results of a shard to those of the others.
void unite(const std::string& file, const WorkFile& shard, WorkFile& all) {
  const auto fail = [&](const std::string& what) { throw std::invalid_argument(printable(file + ": " + what)); };
  const std::string other = difference(shard.origin, all.origin);
  if (!other.empty()) fail("is of another render than the first shard: " + other);
  if (shard.part.count != all.part.count)
    fail(fmt::format("is one of {} shards, the first one of {}", shard.part.count, all.part.count));
  if (!shard.is_complete)
    fail(fmt::format("is not complete; continue it with --shard {}/{} --resume", shard.part.index + 1,
                     shard.part.count));
  all.results.insert(shard.results.begin(), shard.results.end());
}

}  // namespace

WorkFile read_shards(const std::vector<std::string>& files) {
  WorkFile all;
  std::map<std::size_t, std::string> names;
  for (const std::string& file : files) {
    const WorkFile shard = read_work(file);
    if (names.empty()) all = shard;
    const std::size_t index = shard.part.index;
    unite(file, shard, all);
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
  all.part.index = 0;
  return all;
}

}  // namespace tensorray
