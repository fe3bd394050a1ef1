#include "base/process/process_limits.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <future>
#include <limits>
#include <new>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include <unistd.h>

#include "base/text/text.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The numbers of a file; "max" is no limit. Empty if there is no such file.
std::vector<double> numbers_in(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<double> numbers;
  for (std::string word; stream >> word;) {
    std::istringstream text(word);
    double number = unlimited;
    if (word != "max" && !(text >> number)) break;
    numbers.push_back(number);
  }
  return numbers;
}

/// The folders of cgroups that hold this process and have limits of a kind, from its own to the outermost. In a
/// container its own is often shown as the outermost.
/// @param controller  "cpu" or "memory": the name of the kind in the first version of cgroups.
std::vector<fs::path> cgroups(const fs::path& root, const std::string& controller) {
  const fs::path all = root / "sys" / "fs" / "cgroup";
  std::vector<fs::path> folders;
  std::ifstream lines(root / "proc" / "self" / "cgroup");
  for (std::string line; std::getline(lines, line);) {  // "0::/path", or of the first version "4:cpu,cpuacct:/path".
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string kinds = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool is_unified = kinds == ",,";
    if (!is_unified && kinds.find("," + controller + ",") == std::string::npos) continue;
    const fs::path top = is_unified ? all : all / controller;
    for (fs::path inner = fs::path(line.substr(second + 1)).relative_path(); !inner.empty();
         inner = inner.parent_path())
      folders.push_back(top / inner);
    folders.push_back(top);
  }
  return folders;
}

double quota(const fs::path& root) {
  double processors = unlimited;
  for (const fs::path& group : cgroups(root, "cpu")) {
    std::vector<double> times = numbers_in(group / "cpu.max");  // Quota and period.
    if (times.empty()) {
      times = numbers_in(group / "cpu.cfs_quota_us");  // -1: none.
      for (const double period : numbers_in(group / "cpu.cfs_period_us")) times.push_back(period);
    }
    if (times.size() == 2 && times[0] > 0 && times[1] > 0) processors = std::min(processors, times[0] / times[1]);
  }
  return processors;
}

/// Memory and swap of the machine.
double machine_memory(const fs::path& root) {
  std::ifstream stream(root / "proc" / "meminfo");
  double kibibytes = 0;
  for (std::string line; std::getline(stream, line);)
    if (starts_with(line, "MemTotal:") || starts_with(line, "SwapTotal:"))
      kibibytes += std::strtod(line.c_str() + line.find(':') + 1, nullptr);
  return kibibytes > 0 ? 1024 * kibibytes : unlimited;
}

double container_memory(const fs::path& root) {
  double bytes = unlimited;
  for (const fs::path& group : cgroups(root, "memory"))
    for (const char* file : {"memory.max", "memory.limit_in_bytes"})
      for (const double each : numbers_in(group / file)) bytes = std::min(bytes, each);
  return bytes;
}

/// Bytes that this process has. @param column  What counts, in /proc/self/statm.
double used_memory(std::size_t column) {
  const std::vector<double> pages = numbers_in("/proc/self/statm");
  return column < pages.size() ? pages[column] * static_cast<double>(sysconf(_SC_PAGESIZE)) : 0;
}

/// What is left of a limit of this process, of which libraries and stacks have a part, too.
double own_limit(decltype(RLIMIT_AS) resource, std::size_t column) {
  rlimit limit{};
  if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return unlimited;
  return std::max(0.0, static_cast<double>(limit.rlim_cur) - used_memory(column));
}

/// Lowers the limit of this process's data.
void limit_data(double bytes) {
#ifndef TENSORRAY_SANITIZED  // Sanitizers reserve memory many times over.
  rlimit limit{};
  if (bytes >= 0x1p62 || getrlimit(RLIMIT_DATA, &limit) != 0) return;
  limit.rlim_cur = std::min(limit.rlim_cur, static_cast<rlim_t>(bytes));
  setrlimit(RLIMIT_DATA, &limit);
#else
  static_cast<void>(bytes);
#endif
}

}  // namespace

unsigned usable_processors(const fs::path& root) {
  const double affinity = std::max(1u, std::thread::hardware_concurrency());
  return static_cast<unsigned>(std::max(1.0, std::min(affinity, std::ceil(quota(root)))));
}

MemoryLimit memory_limit(const fs::path& root) {
  const std::vector<MemoryLimit> limits{{machine_memory(root), "this machine's memory"},
                                        {container_memory(root), "the container's limit"},
                                        {own_limit(RLIMIT_AS, 0), "what `ulimit -v` leaves"},
                                        {own_limit(RLIMIT_DATA, 5), "what `ulimit -d` leaves"}};
  return *std::min_element(limits.begin(), limits.end(),
                           [](const MemoryLimit& a, const MemoryLimit& b) { return a.bytes < b.bytes; });
}

void limit_memory() { limit_data(0.875 * memory_limit().bytes); }

ExtraMemoryLimit::ExtraMemoryLimit(double bytes) {
  getrlimit(RLIMIT_DATA, &before_);
  limit_data(used_memory(5) + bytes);
}

ExtraMemoryLimit::~ExtraMemoryLimit() { setrlimit(RLIMIT_DATA, &before_); }

void require_stack() {
  constexpr rlim_t least = 256 << 10;  // Twice what renders and imports were seen to need.
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur < least)
    throw std::runtime_error("the stack may have " + bytes_text(static_cast<double>(limit.rlim_cur)) + ", but needs " +
                             bytes_text(static_cast<double>(least)) + "; raise `ulimit -s`");
}

void require_threads(unsigned count) {
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future().share();
  std::vector<std::thread> threads;
  threads.reserve(count);
  std::string reason;
  try {
    while (threads.size() < count) threads.emplace_back([ended] { ended.wait(); });
  } catch (const std::system_error& error) {
    reason = error.code().message();
  } catch (const std::bad_alloc&) {  // Those that have started must be joined.
    reason = "out of memory";
  }
  const std::size_t started = threads.size();
  end.set_value();
  for (std::thread& thread : threads) thread.join();
  if (!reason.empty())
    throw std::runtime_error(
        "only " + std::to_string(started) + " of " + std::to_string(count) + " threads can be started: " + reason +
        "; give fewer with --threads, or raise `ulimit -u`, `ulimit -v` or the container's limits");
}

}  // namespace tensorray
