#include "base/process/team.h"

#include <algorithm>
#include <stdexcept>

#include "base/text/copy_bytes.h"

namespace tensorray {
namespace {

constexpr std::size_t bytes_at_once = std::size_t{1} << 26;  // In a message.

[[noreturn]] void fail() {
  throw std::runtime_error("mpirun: the ranks do not do the same work; start the same program on all machines");
}

/// Copies the parts of one process in a range of parts.
void copy_parts(std::size_t process, std::size_t processes, std::size_t begin, std::size_t end, const CopyPart& copy,
                PartBytes& bytes) {
  const std::size_t first = begin + (process + processes - begin % processes) % processes;
  for (std::size_t part = first; part < end; part += processes) copy(part, bytes);
}

std::string bytes_of_mine(const Team& team, std::size_t begin, std::size_t end, const CopyPart& copy) {
  PartBytes mine;
  copy_parts(team.index(), team.count(), begin, end, copy, mine);
  return mine.take();
}

/// Copies what the others have given.
void take_others(const Team& team, std::vector<std::string> given, std::size_t begin, std::size_t end,
                 const CopyPart& copy) {
  for (std::size_t process = 0; process < given.size(); ++process) {
    if (process == team.index()) continue;
    PartBytes bytes(std::move(given[process]));
    copy_parts(process, team.count(), begin, end, copy, bytes);
    if (!bytes.ends()) fail();
  }
}

}  // namespace

void PartBytes::copy(void* values, std::size_t size) {
  if (!reads_) {
    bytes_.append(static_cast<const char*>(values), size);
    return;
  }
  if (size > bytes_.size() - at_) fail();
  copy_bytes(values, bytes_.data() + at_, size);
  at_ += size;
}

std::size_t PartBytes::there_are(std::size_t count, std::size_t size) const {
  if (count > (bytes_.size() - at_) / size) fail();
  return count;
}

void exchange_parts(Team& team, std::size_t parts, std::size_t at_once, const CopyPart& copy) {
  for (std::size_t begin = 0; begin < parts; begin += at_once) {
    const std::size_t end = std::min(begin + at_once, parts);
    take_others(team, team.exchange(bytes_of_mine(team, begin, end, copy)), begin, end, copy);
  }
}

void copy_of_first(Team& team, void* values, std::size_t size) {
  auto* const bytes = static_cast<char*>(values);
  for (std::size_t begin = 0; begin < size; begin += bytes_at_once) {
    const std::size_t count = std::min(bytes_at_once, size - begin);
    const std::string first = team.exchange(has_all(&team) ? std::string(bytes + begin, count) : std::string()).front();
    if (first.size() != count) fail();
    copy_bytes(bytes + begin, first.data(), count);
  }
}

void collect_parts(Team& team, std::size_t parts, std::size_t at_once, const CopyPart& copy) {
  for (std::size_t begin = 0; begin < parts; begin += at_once) {
    const std::size_t end = std::min(begin + at_once, parts);
    take_others(team, team.collect(bytes_of_mine(team, begin, end, copy)), begin, end, copy);
  }
}

}  // namespace tensorray
