#pragma once
/// What this process may use of the machine.

#include <filesystem>
#include <string>

#include <sys/resource.h>

namespace tensorray {

/// The processors that this process may use, at least 1: those of its affinity, or fewer where a container has a quota
/// of processor time (cpu.max of cgroups, cpu.cfs_quota_us of their first version), rounded up.
/// @param root  The root of the file system, for tests.
unsigned usable_processors(const std::filesystem::path& root = "/");

struct MemoryLimit {
  double bytes = 0;   ///< Infinite if nothing is known.
  std::string cause;  ///< What sets it, for a message: "this machine's memory".
};

/// The least of: the machine's memory and swap, that of containers (cgroups), and what `ulimit -v` and `-d` leave.
MemoryLimit memory_limit(const std::filesystem::path& root = "/");

/// Has allocations fail where this process alone would take most of memory_limit(), for programs that read files which
/// may announce any size: the system would end this program otherwise, or others. Does nothing under sanitizers.
void limit_memory();

/// Until it is destroyed, allocations fail where this process would take so many bytes more than it has: for the
/// reading of a file whose size is known. Does nothing under sanitizers.
class ExtraMemoryLimit {
 public:
  explicit ExtraMemoryLimit(double bytes);
  ~ExtraMemoryLimit();
  ExtraMemoryLimit(const ExtraMemoryLimit&) = delete;
  ExtraMemoryLimit& operator=(const ExtraMemoryLimit&) = delete;

 private:
  rlimit before_{};
};

/// Checks that stacks are large enough: one that ends cannot be reported.
/// @throw std::runtime_error with the fix.
void require_stack();

/// Checks that `count` threads can be started at once, besides those that run. Libraries that meet this only later end
/// the process. @throw std::runtime_error with the cause and the fix.
void require_threads(unsigned count);

}  // namespace tensorray
