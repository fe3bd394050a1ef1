// Limits of containers, which are files of the system.

#include "base/process/process_limits.h"

#include <csignal>
#include <fstream>
#include <map>
#include <memory>
#include <new>
#include <thread>

#include <sys/resource.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "base/process/child_program.h"
#include "base/process/progress.h"
#include "tests/files.h"

namespace tensorray {
namespace {

/// A system's files: path → content.
using Files = std::map<std::string, std::string>;

class System {
 public:
  explicit System(const Files& files) {
    for (const auto& [name, text] : files) write_bytes(root() / name, text);
  }
  std::filesystem::path root() const { return folder_ / "root"; }

 private:
  TemporaryFolder folder_;
};

const Files::value_type memory_of_1000_kib{"proc/meminfo",
                                           "MemTotal:        800 kB\nMemFree: 9 kB\nSwapTotal:   200 kB\n"};
const Files::value_type in_container{"proc/self/cgroup", "0::/\n"};

TEST(ProcessLimitsTest, QuotasAreFoundWhereSystemsHaveThem) {
  const double all = std::thread::hardware_concurrency();
  struct Case {
    const char* what;
    Files files;
    double processors;  ///< Infinite: no quota.
  };
  const double none = INFINITY;
  const std::vector<Case> cases{
      {"nothing is known", {}, none},
      {"a container", {in_container, {"sys/fs/cgroup/cpu.max", "100000 100000\n"}}, 1},
      {"no quota", {in_container, {"sys/fs/cgroup/cpu.max", "max 100000\n"}}, none},
      {"a part", {in_container, {"sys/fs/cgroup/cpu.max", "50000 100000\n"}}, 1},
      {"more than one", {in_container, {"sys/fs/cgroup/cpu.max", "150000 100000\n"}}, 2},
      {"of an outer group",
       {{"proc/self/cgroup", "0::/jobs/17/step\n"},
        {"sys/fs/cgroup/jobs/17/step/cpu.max", "max 100000\n"},
        {"sys/fs/cgroup/jobs/17/cpu.max", "100000 100000\n"},
        {"sys/fs/cgroup/jobs/cpu.max", "800000 100000\n"}},
       1},
      {"a group that is not shown inside the container",
       {{"proc/self/cgroup", "0::/docker/abc\n"}, {"sys/fs/cgroup/cpu.max", "100000 100000\n"}},
       1},
      {"the first version of cgroups",
       {{"proc/self/cgroup", "5:memory:/a\n4:cpu,cpuacct:/a\n"},
        {"sys/fs/cgroup/cpu/a/cpu.cfs_quota_us", "100000\n"},
        {"sys/fs/cgroup/cpu/a/cpu.cfs_period_us", "100000\n"}},
       1},
      {"the first version without a quota",
       {{"proc/self/cgroup", "4:cpu,cpuacct:/a\n"},
        {"sys/fs/cgroup/cpu/a/cpu.cfs_quota_us", "-1\n"},
        {"sys/fs/cgroup/cpu/a/cpu.cfs_period_us", "100000\n"}},
       none},
      {"not a number", {in_container, {"sys/fs/cgroup/cpu.max", "much of it\n"}}, none},
      {"nonsense", {{"proc/self/cgroup", "\n:\n::\n0\n"}, {"sys/fs/cgroup/cpu.max", "0 0\n"}}, none}};
  for (const Case& each : cases)
    EXPECT_EQ(usable_processors(System(each.files).root()), std::min(all, each.processors)) << each.what;
}

TEST(ProcessLimitsTest, TheLeastMemoryCounts) {
  struct Case {
    const char* what;
    Files files;
    double bytes;
    const char* cause;
  };
  const char *machine = "this machine's memory", *container = "the container's limit";
  const std::vector<Case> cases{
      {"a machine", {memory_of_1000_kib}, 1024000, machine},
      {"a container", {memory_of_1000_kib, in_container, {"sys/fs/cgroup/memory.max", "5000\n"}}, 5000, container},
      {"without a limit", {memory_of_1000_kib, in_container, {"sys/fs/cgroup/memory.max", "max\n"}}, 1024000, machine},
      {"the first version",
       {memory_of_1000_kib,
        {"proc/self/cgroup", "5:memory:/a\n"},
        {"sys/fs/cgroup/memory/a/memory.limit_in_bytes", "7000\n"},
        {"sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"}},
       7000,
       container}};
  for (const Case& each : cases) {
    const MemoryLimit limit = memory_limit(System(each.files).root());
    EXPECT_EQ(limit.bytes, each.bytes) << each.what;
    EXPECT_EQ(limit.cause, each.cause) << each.what;
  }
  EXPECT_TRUE(std::isinf(memory_limit(System({}).root()).bytes));
}

TEST(ProcessLimitsTest, LimitsOfTheProcessCount) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &before), 0);
  rlim_t pages = 0;  // That are in use; sanitizers use thousands of gigabytes.
  std::ifstream statm("/proc/self/statm");
  for (int column = 0; column <= 5; ++column) statm >> pages;
  const rlim_t limit = rlim_t{1} << 33;
  const rlimit lower{pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + limit, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_DATA, &lower), 0);
  const MemoryLimit found = memory_limit(System({}).root());
  setrlimit(RLIMIT_DATA, &before);
  EXPECT_NEAR(found.bytes, static_cast<double>(limit), 1 << 26);  // Some is taken meanwhile.
  EXPECT_NE(found.cause.find("ulimit -d"), std::string::npos);
}

TEST(ProcessLimitsTest, ExtraMemoryHasALimitForAWhile) {
#ifdef TENSORRAY_SANITIZED
  GTEST_SKIP() << "sanitizers have no such limit";
#endif
  const std::size_t bytes = std::size_t{200} << 20;
  {
    const ExtraMemoryLimit limit(0x1p26);
    EXPECT_THROW(std::make_unique<char[]>(bytes), std::bad_alloc);
  }
  EXPECT_NO_THROW(std::make_unique<char[]>(bytes));
}

ProgramEnd run_shell(const std::string& command, const UnnamedFile& shared = {}) {
  return run_program("/bin/sh", {"-c", command}, shared);
}

TEST(ChildProgram, SaysHowItEnded) {
  const ProgramEnd good = run_shell("exit 0"), bad = run_shell("echo 'what went wrong' >&2; exit 3");
  EXPECT_EQ(good.status, 0);
  EXPECT_EQ(good.signal, 0);
  EXPECT_EQ(good.error, "");
  EXPECT_EQ(bad.status, 3);
  EXPECT_EQ(bad.error, "what went wrong\n");
  EXPECT_EQ(run_shell("kill -SEGV $$").signal, SIGSEGV);
}

TEST(ChildProgram, ThatIsInterruptedCancels) {
  std::signal(SIGINT, SIG_DFL);  // A shell's background ignores it.
  for (const char* signal : {"INT", "TERM"})
    EXPECT_THROW(run_shell("kill -" + std::string(signal) + " $$"), Cancelled) << signal;
}

TEST(ChildProgram, ThatIsMissingIsNamed) {
  const std::string error = message([] { run_program("/no/such/program", {}, UnnamedFile()); });
  EXPECT_THAT(error, HasSubstr("/no/such/program cannot be started: No such file"));
}

TEST(ChildProgram, SharesAFile) {
  const UnnamedFile shared;
  std::ofstream(shared.path()) << "there\n";
  const std::string file = shared_file;
  const ProgramEnd end = run_shell("read text < " + file + "; echo \"$text and back\" > " + file, shared);
  EXPECT_EQ(end.status, 0) << end.error;
  EXPECT_EQ(bytes_of(shared.path()), "there and back\n");
}

}  // namespace
}  // namespace tensorray
