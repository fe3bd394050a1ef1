#pragma once
/// What a method has computed of a field, kept for the next scenes of the same field.

#include <deque>
#include <memory>
#include <mutex>
#include <string>

namespace tensorray {

/// A few results, each by a text of all that it depends on, the field aside. Any number of threads may use it at once.
class KeptResults {
 public:
  static constexpr std::size_t max_bytes = 800u << 20;

  /// Null if it is not kept. The type must be that of what was kept.
  template <class Result>
  std::shared_ptr<const Result> find(const std::string& key) const {
    const std::lock_guard lock(mutex_);
    for (const Entry& entry : entries_)
      if (entry.key == key) return std::static_pointer_cast<const Result>(entry.result);
    return nullptr;
  }

  /// Forgets the oldest results where all would be more than `max_bytes`. A larger one is not kept.
  template <class Result>
  void keep(const std::string& key, Result result, std::size_t bytes) {
    if (bytes > max_bytes) return;
    const std::lock_guard lock(mutex_);
    for (bytes_ += bytes; bytes_ > max_bytes; entries_.pop_front()) bytes_ -= entries_.front().bytes;
    entries_.push_back({key, std::make_shared<const Result>(std::move(result)), bytes});
  }

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const void> result;
    std::size_t bytes;
  };

  mutable std::mutex mutex_;
  std::deque<Entry> entries_;
  std::size_t bytes_ = 0;
};

}  // namespace tensorray
