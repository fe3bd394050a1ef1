#include "base/process/work.h"

#include <stdexcept>
#include <utility>

#include <fmt/core.h>

namespace tensorray {

void Work::begin(std::size_t units) {
  const std::lock_guard lock(mutex_);
  if (!units_.empty() && units_.size() != units)
    throw DamagedWork(fmt::format("the work has {} units, but {} were kept", units, units_.size()));
  units_.resize(units);
}

std::size_t Work::size() const {
  const std::lock_guard lock(mutex_);
  return units_.size();
}

bool Work::wants(std::size_t unit) const {
  const std::lock_guard lock(mutex_);
  return is_in_part(unit) && !units_.at(unit).done;
}

std::shared_ptr<const std::string> Work::state(std::size_t unit) const {
  const std::lock_guard lock(mutex_);
  return units_.at(unit).state;
}

void Work::keep(std::size_t unit, std::string state, bool done) {
  auto kept = std::make_shared<const std::string>(std::move(state));
  const std::lock_guard lock(mutex_);
  WorkUnit& each = units_.at(unit);
  each.state.swap(kept);  // The old state is freed after the lock.
  each.done = done;
}

std::vector<WorkUnit> Work::units() const {
  const std::lock_guard lock(mutex_);
  return units_;
}

}  // namespace tensorray
