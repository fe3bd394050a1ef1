#include "base/process/ranks.h"

namespace tensorray {

void gather_in_turn(Ranks* ranks, const std::function<void(Archive& archive)>& copy) {
  for (std::size_t rank = 1; ranks && rank < ranks->count(); ++rank) {
    Archive mine;
    if (ranks->rank() == rank) copy(mine);
    const std::vector<std::string> given = ranks->gather(mine.take());
    if (!is_root(ranks)) continue;
    Archive archive(given.at(rank));
    copy(archive);
    archive.finish();
  }
}

}  // namespace tensorray
