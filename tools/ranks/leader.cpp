#include "tools/ranks/leader.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace tensorray {
namespace {

constexpr std::chrono::milliseconds pause(1);
constexpr std::size_t most_rounds = 8;  ///< Units that a rank gets at once, for each of its threads.

}  // namespace

Leader::Leader(Ranks& ranks, const Progress& progress)
    : ranks_(ranks), progress_(progress), given_(static_cast<std::size_t>(ranks.count())) {
  traffic_.units.resize(given_.size());
  thread_ = std::thread([this] { run(); });
}

Leader::~Leader() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  thread_.join();
}

void Leader::run() {
  try {
    for (;;) {
      bool has_message = false;
      {
        const std::lock_guard lock(mutex_);  // `end` and `do_step` send from other threads.
        if (ends_) return;
        const auto message = ranks_.receive();
        has_message = message.has_value();
        if (has_message) receive(message->from, rank_message(message->bytes));
        answer();
      }
      if (!has_message) std::this_thread::sleep_for(pause);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    error_ = std::current_exception();
  }
}

void Leader::rethrow() const {
  const std::lock_guard lock(mutex_);
  if (error_) std::rethrow_exception(error_);
}

void Leader::send(int to, const RankMessage& message) {
  const std::string bytes = bytes_of(message);
  ++traffic_.messages;
  traffic_.bytes_sent += bytes.size();
  ranks_.send(to, bytes);
}

void Leader::receive(int from, RankMessage message) {
  ++traffic_.messages;
  traffic_.bytes_received += size_of(message);
  const bool is_current = shared_ && shared_->number == message.job;
  if (message.word == RankWord::job) idle_.insert(from);
  if (message.word == RankWord::more) {
    if (is_current && !has_begun())
      shared_->waiting.emplace_back(from, message.number);
    else
      send_units(from, message.job, message.number);
  }
  if (message.word == RankWord::part && is_current) {
    if (!shared_->work) ++traffic_.units[static_cast<std::size_t>(from)];
    shared_->parts[from].push_back(std::move(message.bytes));
  }
  if (message.word != RankWord::unit || !is_current) return;
  if (message.is_done != 0) {
    --shared_->away;
    ++traffic_.units[static_cast<std::size_t>(from)];
  }
  shared_->work->keep(message.number, std::move(message.bytes), message.is_done != 0);
}

/// Answers the ranks that wait, if there is something for them.
void Leader::answer() {
  if (shared_ && has_begun())
    for (const auto& [rank, threads] : std::exchange(shared_->waiting, {})) send_units(rank, shared_->number, threads);
  for (auto rank = idle_.begin(); rank != idle_.end();) {
    std::uint32_t& given = given_[static_cast<std::size_t>(*rank)];
    if (!offered_.empty()) {
      send(*rank, {RankWord::job, given = ++jobs_, 0, 0, offered_.front()});
      offered_.pop_front();
    } else if (shared_ && given != shared_->number && has_units()) {
      send(*rank, {RankWord::job, given = shared_->number, 0, 0, shared_->text});
    } else if (is_finishing_) {
      send(*rank, {RankWord::finish, 0, 0, 0, {}});
      ++finished_;
    } else {
      ++rank;
      continue;
    }
    rank = idle_.erase(rank);
  }
}

/// Units for one rank: fewer towards the end, but one for each of its threads.
std::vector<std::size_t> Leader::take_units(std::size_t threads) {
  const Work& work = *shared_->work;
  const std::size_t size = work.size(), shares = 4 * given_.size();
  const std::size_t wanted = std::clamp((size - shared_->next) / shares, threads, most_rounds * threads);
  std::vector<std::size_t> units;
  for (; shared_->next < size && units.size() < wanted; ++shared_->next)
    if (work.wants(shared_->next)) units.push_back(shared_->next);
  return units;
}

void Leader::send_units(int to, std::uint32_t job, std::size_t threads) {
  if (shared_ && shared_->number == job)
    for (const std::size_t unit : take_units(std::max<std::size_t>(1, threads))) {
      const auto state = shared_->work->state(unit);
      send(to, {RankWord::unit, job, unit, 0, state ? *state : std::string()});
      ++shared_->away;
    }
  send(to, {RankWord::more, job, 0, 0, {}});
}

/// The units of this rank. At the end waits for those of the others.
std::vector<std::size_t> Leader::next_units(std::size_t threads) {
  for (;;) {
    rethrow();
    {
      const std::lock_guard lock(mutex_);
      Work& work = *shared_->work;
      std::vector<std::size_t>& mine = shared_->mine;
      const auto first_done = std::remove_if(mine.begin(), mine.end(), [&](std::size_t i) { return !work.wants(i); });
      traffic_.units[0] += static_cast<std::uint64_t>(mine.end() - first_done);
      mine.erase(first_done, mine.end());
      if (progress_.cancelled) work.stopping = true;
      if (work.stopping) return {};
      if (mine.empty()) mine = take_units(threads);
      if (!mine.empty() || shared_->away == 0) return mine;
    }
    std::this_thread::sleep_for(pause);
  }
}

Team& Leader::share(const std::string& job, Work& work, std::size_t threads) {
  work.next = [this, threads] { return next_units(threads); };
  const std::lock_guard lock(mutex_);
  shared_.emplace();
  shared_->number = ++jobs_;
  shared_->text = job;
  shared_->work = &work;
  return *this;
}

Team& Leader::share_steps(const std::string& job) {
  const std::lock_guard lock(mutex_);
  shared_.emplace();
  shared_->number = ++jobs_;
  shared_->text = job;
  return *this;
}

/// The parts of the next step, by rank, with nothing for this one; none if a rank has not done its part.
std::optional<std::vector<std::string>> Leader::take_parts() {
  for (int rank = 1; rank < ranks_.count(); ++rank)
    if (shared_->parts[rank].empty()) return std::nullopt;
  std::vector<std::string> parts(given_.size());
  for (auto& [rank, waiting] : shared_->parts) {
    parts[static_cast<std::size_t>(rank)] = std::move(waiting.front());
    waiting.pop_front();
  }
  return parts;
}

std::vector<std::string> Leader::do_step(std::string mine, bool gives_back) {
  for (;;) {
    rethrow();
    if (progress_.cancelled) throw Cancelled();
    {
      const std::lock_guard lock(mutex_);
      if (auto parts = take_parts()) {
        if (!shared_->work) ++traffic_.units[0];
        parts->front() = std::move(mine);
        if (gives_back)
          for (const int rank : next_ranks(0, ranks_.count()))
            send(rank, {RankWord::part, shared_->number, 0, 0, packed(*parts)});
        return std::move(*parts);
      }
    }
    std::this_thread::sleep_for(pause);
  }
}

void Leader::end() {
  const std::lock_guard lock(mutex_);
  if (!shared_) return;
  for (const auto& [rank, threads] : shared_->waiting) send(rank, {RankWord::more, shared_->number, 0, 0, {}});
  shared_.reset();
}

void Leader::offer(std::deque<std::string> jobs) {
  const std::lock_guard lock(mutex_);
  offered_ = std::move(jobs);
}

std::optional<std::string> Leader::take() {
  rethrow();
  const std::lock_guard lock(mutex_);
  if (offered_.empty()) return std::nullopt;
  std::string job = std::move(offered_.front());
  offered_.pop_front();
  return job;
}

void Leader::finish() {
  for (;;) {
    rethrow();
    if (progress_.cancelled) throw Cancelled();
    {
      const std::lock_guard lock(mutex_);
      is_finishing_ = true;
      if (finished_ == ranks_.count() - 1) return;
    }
    std::this_thread::sleep_for(pause);
  }
}

RankTraffic Leader::traffic() const {
  const std::lock_guard lock(mutex_);
  return traffic_;
}

}  // namespace tensorray
