#include "base/process/child_program.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "base/process/progress.h"

namespace tensorray {
namespace {

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

ProgramEnd run_shell(const std::string& command, const UnnamedFile& shared = {}) {
  return run_program("/bin/sh", {"-c", command}, shared);
}

TEST(ChildProgram, SaysHowItEnded) {
  const ProgramEnd good = run_shell("exit 0");
  EXPECT_EQ(good.status, 0);
  EXPECT_EQ(good.signal, 0);
  EXPECT_EQ(good.error, "");
  const ProgramEnd bad = run_shell("echo 'what went wrong' >&2; exit 3");
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
  try {
    run_program("/no/such/program", {}, UnnamedFile());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/program cannot be started: No such file"), std::string::npos);
  }
}

TEST(ChildProgram, SharesAFile) {
  const UnnamedFile shared;
  std::ofstream(shared.path()) << "there\n";
  const std::string file = shared_file;
  const ProgramEnd end = run_shell("read text < " + file + "; echo \"$text and back\" > " + file, shared);
  EXPECT_EQ(end.status, 0) << end.error;
  EXPECT_EQ(text_of(shared.path()), "there and back\n");
}

}  // namespace
}  // namespace tensorray
