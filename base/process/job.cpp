#include "base/process/job.h"

#include <algorithm>
#include <thread>
#include <vector>

#include <tbb/parallel_for.h>

namespace tensorray {
namespace {

/// The units of a round, by the rank that makes them.
class Round {
 public:
  Round(const Units& units, Job* job, std::size_t begin) : units_(units), job_(job), begin_(begin) {
    const std::size_t end = std::min(begin + units.round, units.count);
    for (std::size_t unit = begin; unit < end; ++unit)
      if (!is_kept() || job->has(unit)) numbers_.push_back(unit);
  }

  void make(const std::string& phase, const Progress& progress) {
    const std::thread::id caller = std::this_thread::get_id();
    const std::size_t total = units_.total > 0 ? units_.total : units_.count;
    std::atomic<std::size_t> done{units_.first + begin_};
    is_found_.assign(numbers_.size(), 0);
    tbb::parallel_for(std::size_t{0}, numbers_.size(), [&](std::size_t i) {
      if (progress.cancelled) throw Cancelled();
      is_found_[i] = restore(numbers_[i]) ? 1 : 0;
      if (is_found_[i] == 0 && is_mine(ranks(), i)) units_.make(numbers_[i]);
      const std::size_t now = ++done;
      if (std::this_thread::get_id() == caller) progress.update(phase, std::min(now, total), total);
    });
  }

  /// Gives what this rank has made to the others, and takes theirs.
  void share() {
    if (!ranks()) return;
    Archive mine;
    if (units_.for_all || !is_root(ranks())) copy(ranks()->rank(), mine);
    const std::vector<std::string> given =
        units_.for_all ? ranks()->all_gather(mine.take()) : ranks()->gather(mine.take());
    for (std::size_t rank = 0; rank < given.size(); ++rank) {
      if (rank == ranks()->rank()) continue;
      Archive archive(given[rank]);
      copy(rank, archive);
      archive.finish();
    }
  }

  void keep() const {
    for (std::size_t i = 0; is_kept() && is_root(ranks()) && i < numbers_.size(); ++i) {
      if (is_found_[i] != 0) continue;
      Archive archive;
      units_.copy(numbers_[i], archive);
      job_->keep(name(numbers_[i]), archive.take());
    }
  }

 private:
  Ranks* ranks() const { return job_ ? job_->ranks : nullptr; }
  bool is_kept() const { return job_ && !units_.kind.empty(); }
  std::string name(std::size_t unit) const { return units_.kind + ' ' + std::to_string(unit); }

  bool restore(std::size_t unit) const {
    const Result found = is_kept() ? job_->find(name(unit)) : nullptr;
    if (!found) return false;
    Archive archive(*found);
    units_.copy(unit, archive);
    archive.finish();
    return true;
  }

  /// What a rank has made.
  void copy(std::size_t rank, Archive& archive) const {
    for (std::size_t i = rank; i < numbers_.size(); i += ranks()->count())
      if (is_found_[i] == 0) units_.copy(numbers_[i], archive);
  }

  const Units& units_;
  Job* const job_;
  const std::size_t begin_;
  std::vector<std::size_t> numbers_;
  std::vector<char> is_found_;  // Whether it was kept: all ranks have it then.
};

}  // namespace

Result Job::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = results_.find(name);
  return found == results_.end() ? nullptr : found->second;
}

void Job::keep(const std::string& name, std::string bytes) {
  auto kept = std::make_shared<const std::string>(std::move(bytes));
  const std::lock_guard lock(mutex_);
  results_[name].swap(kept);  // The old one is freed after the lock.
}

Results Job::results() const {
  const std::lock_guard lock(mutex_);
  return results_;
}

void make_units(const Units& units, Job* job, const std::string& phase, const Progress& progress) {
  for (std::size_t begin = 0; begin < units.count; begin += units.round) {
    if (begin > 0 && units.shown) units.shown();
    Round round(units, job, begin);
    round.make(phase, progress);
    round.share();
    round.keep();
  }
}

void find_or_make(Job* job, const std::string& name, const std::function<void()>& make,
                  const std::function<void(Archive& archive)>& copy) {
  if (const Result found = job ? job->find(name) : nullptr) {
    Archive archive(*found);
    copy(archive);
    return archive.finish();
  }
  const Clock::time_point begun = Clock::now();
  make();
  if (!job || !job->is_long()) return;
  const double seconds = seconds_since(begun);
  Archive archive;
  copy(archive);
  if (std::string bytes = archive.take(); job->is_worth(bytes.size(), seconds)) job->keep(name, std::move(bytes));
}

}  // namespace tensorray
