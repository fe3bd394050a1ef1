#include "tools/command_line/threads.h"

#include <algorithm>

#include <tbb/task_arena.h>

#include "base/process/process_limits.h"

namespace tensorray {
namespace {

/// Others that a run has: it keeps its work, watches its memory, and writes files.
constexpr unsigned helpers = 4;

unsigned checked(unsigned asked) {
  const unsigned count = asked > 0 ? asked : usable_processors();
  require_threads(std::min<unsigned>(count, static_cast<unsigned>(tbb::this_task_arena::max_concurrency())) + helpers);
  return count;
}

}  // namespace

Threads::Threads(unsigned asked) : limit_(tbb::global_control::max_allowed_parallelism, checked(asked)) {}

unsigned running_threads() {
  const std::size_t allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min(static_cast<unsigned>(allowed), static_cast<unsigned>(tbb::this_task_arena::max_concurrency()));
}

}  // namespace tensorray
