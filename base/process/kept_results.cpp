#include "base/process/kept_results.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "base/process/progress.h"
#include "base/process/team.h"
#include "base/process/work.h"

namespace tensorray {
namespace {

constexpr int least_ratio = 50;  // Of the time between two times of keeping to the time they take.

constexpr std::uint64_t part_bit = std::uint64_t{1} << 63;
constexpr std::size_t changed = ~std::size_t{0};

/// What stands before the bytes of a result.
struct ResultHead {
  ResultKey key;
  std::uint64_t size;  // With part_bit if it is a part of one.
};

bool is_part(const ResultHead& head) { return (head.size & part_bit) != 0; }
std::uint64_t size_of(const ResultHead& head) { return head.size & ~part_bit; }

ResultHead head_at(const std::string& bytes, std::size_t at) {
  ResultHead head;
  std::memcpy(&head, &bytes[at], sizeof head);
  return head;
}

[[noreturn]] void fail_damaged() { throw DamagedWork("what was kept of the render is damaged; render it again"); }

/// Copies a result from its bytes, which must be all there are of it.
void take_result(std::string from, const std::function<void(PartBytes& bytes)>& copy) {
  PartBytes bytes(std::move(from));
  try {
    copy(bytes);
  } catch (const std::runtime_error&) {
    fail_damaged();
  }
  if (!bytes.ends()) fail_damaged();
}

}  // namespace

std::size_t KeptResults::Hash::operator()(const ResultKey& key) const { return hash_of(&key, sizeof key); }

KeptResults::KeptResults(Work* work, Team* team) : work_(has_all(team) ? work : nullptr) {
  if (work) {
    part_ = work->part();
    is_shard_ = work->is_shard;
  }
  std::string kept;
  if (work_) {
    work_->begin(work_->size() > 0 ? work_->size() : part_.count);
    for (const WorkUnit& unit : work_->units())
      if (unit.state) kept += *unit.state;
  }
  if (team) share_values(*team, kept);
  take(kept);
}

void KeptResults::take(const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    if (bytes.size() - at < sizeof(ResultHead)) fail_damaged();
    const ResultHead head = head_at(bytes, at);
    if (size_of(head) > bytes.size() - at - sizeof head) fail_damaged();
    places_.emplace(head.key, at);
    at += sizeof head + size_of(head);
  }
  bytes_ = bytes;
  earlier_size_ = kept_size_ = bytes_.size();
}

std::optional<std::string> KeptResults::find(const ResultKey& key) const {
  const auto place = places_.find(key);
  if (place == places_.end()) return std::nullopt;
  const ResultHead head = head_at(bytes_, place->second);
  if (is_part(head)) has_found_part_ = true;
  return bytes_.substr(place->second + sizeof head, size_of(head));
}

std::optional<std::string> KeptResults::find(const ResultKey& key, std::size_t size) const {
  std::optional<std::string> found = find(key);
  if (found && found->size() != size) found.reset();
  return found;
}

bool KeptResults::is_due() const {
  return work_ && work_->interval > 0 && seconds_since(kept_) > std::max(work_->interval / 2, least_ratio * cost_);
}

bool KeptResults::is_long() const {
  return work_ && work_->interval > 0 && seconds_since(begun_) >= work_->interval / 2;
}

void KeptResults::add(const ResultKey& key, const std::string& values) {
  if (!work_ || places_.count(key) > 0) return;
  const ResultHead head{key, values.size() | (parts_from_ ? part_bit : 0)};
  bytes_.append(reinterpret_cast<const char*>(&head), sizeof head).append(values);
}

void KeptResults::forget_parts() {
  if (bytes_.size() > *parts_from_) {
    if (kept_size_ > *parts_from_) kept_size_ = changed;
    bytes_.resize(*parts_from_);
  }
  parts_from_.reset();
  if (has_found_part_) forget_earlier_parts();
}

void KeptResults::forget_earlier_parts() {
  std::string rest;
  std::size_t earlier = 0;
  for (std::size_t at = 0; at < bytes_.size();) {
    const ResultHead head = head_at(bytes_, at);
    const std::size_t size = sizeof head + size_of(head);
    if (is_part(head)) {
      places_.erase(head.key);
    } else {
      if (at < earlier_size_) places_[head.key] = rest.size();
      rest.append(bytes_, at, size);
    }
    at += size;
    if (at <= earlier_size_) earlier = rest.size();
  }
  bytes_ = std::move(rest);
  earlier_size_ = earlier;
  kept_size_ = changed;
  has_found_part_ = false;
}

void KeptResults::keep(bool done) {
  if (!work_) return;
  const auto start = Clock::now();
  work_->keep(part_.index, bytes_, done);
  kept_size_ = bytes_.size();
  kept_ = Clock::now();
  cost_ = seconds_since(start);
}

void KeptResults::finish() {
  if (bytes_.size() != kept_size_) keep(true);
}

void find_or_make(KeptResults* kept, const ResultKey& key, const std::function<void()>& make,
                  const std::function<void(PartBytes& bytes)>& copy) {
  if (std::optional<std::string> found = kept ? kept->find(key) : std::nullopt)
    return take_result(std::move(*found), copy);
  if (kept) kept->begin_parts();
  try {
    make();
  } catch (const Cancelled&) {
    if (kept) kept->finish();
    throw;
  }
  if (!kept) return;
  kept->forget_parts();
  if (!kept->is_long()) return;
  PartBytes bytes;
  copy(bytes);
  kept->add(key, bytes.take());
  if (kept->is_due()) kept->keep(false);
}

}  // namespace tensorray
