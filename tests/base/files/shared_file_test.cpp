// Files that processes of a machine have in common, with processes that end at each step.

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"

namespace tensorray {
namespace {

const std::string bytes = "bytes of a file";

std::string bytes_in(const Descriptor& file) {
  std::string read(bytes.size(), '\0');
  return read_whole_at(file.get(), read.data(), read.size(), 0) ? read : "";
}

/// Processes that tell each other how far they are.
class SharedFiles : public ::testing::Test {
 protected:
  SharedFiles() {
    setenv("TMPDIR", (folder_ / "").c_str(), 1);
    EXPECT_EQ(pipe(told_), 0);
    EXPECT_EQ(pipe(asked_), 0);
  }
  ~SharedFiles() override { unsetenv("TMPDIR"); }

  Descriptor whole_file() const {
    Descriptor file = open_unnamed(folder_ / "");
    EXPECT_TRUE(write_whole(file.get(), bytes));
    return file;
  }

  /// @param work  What the child process does; it ends well if that is true.
  static pid_t start(const std::function<bool()>& work) {
    const pid_t child = fork();
    if (child == 0) _exit(work() ? 0 : 1);
    return child;
  }
  static bool ended_well(pid_t child) {
    int status = 0;
    return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

  void tell() const { EXPECT_TRUE(write_whole(told_[1], "t")); }
  void ask() const { EXPECT_TRUE(write_whole(asked_[1], "a")); }
  static void await(const int (&ends)[2]) {
    char byte = 0;
    EXPECT_EQ(read(ends[0], &byte, 1), 1);
  }

  bool is_empty() const { return std::filesystem::is_empty(folder_ / ""); }

  TemporaryFolder folder_;
  int told_[2], asked_[2];
  const std::function<void()> nothing_ = [] {};
};

TEST_F(SharedFiles, AreFoundWhileAProcessHasThem) {
  const Descriptor file = whole_file();
  {
    SharedFile first("key", nothing_);
    EXPECT_FALSE(first.file().is_open());
    first.offer(file);
    EXPECT_TRUE(ended_well(start([&] { return bytes_in(SharedFile("key", nothing_).file()) == bytes; })));
    EXPECT_FALSE(SharedFile("other", nothing_).file().is_open());
    EXPECT_EQ(bytes_in(SharedFile("key", nothing_).file()), bytes) << "in the same process";
  }
  EXPECT_TRUE(is_empty());
  EXPECT_FALSE(SharedFile("key", nothing_).file().is_open());
  EXPECT_TRUE(is_empty());
}

TEST_F(SharedFiles, AreWaitedFor) {
  const Descriptor file = whole_file();
  SharedFile first("key", nothing_);
  const pid_t second = start([&] { return bytes_in(SharedFile("key", [&] { tell(); }).file()) == bytes; });
  await(told_);  // It waits.
  first.offer(file);
  EXPECT_TRUE(ended_well(second));
}

/// Who has found a file keeps it. Others then make their own.
TEST_F(SharedFiles, EndWithTheProcessThatMadeThem) {
  auto first = std::make_unique<SharedFile>("key", nothing_);
  first->offer(whole_file());
  const SharedFile found("key", nothing_);
  first.reset();
  EXPECT_EQ(bytes_in(found.file()), bytes);
  EXPECT_TRUE(is_empty());
  EXPECT_FALSE(SharedFile("key", nothing_).file().is_open());
}

TEST_F(SharedFiles, AreMadeAgainIfTheirProcessIsKilled) {
  for (const bool is_complete : {false, true}) {
    const pid_t first = start([&] {
      SharedFile made("key", nothing_);
      if (is_complete) made.offer(whole_file());
      tell();
      await(asked_);
      return true;
    });
    await(told_);
    kill(first, SIGKILL);
    EXPECT_FALSE(ended_well(first));
    SharedFile second("key", nothing_);
    EXPECT_FALSE(second.file().is_open());
    second.offer(whole_file());
    EXPECT_EQ(bytes_in(SharedFile("key", nothing_).file()), bytes);
  }
  EXPECT_TRUE(is_empty());
}

TEST_F(SharedFiles, WaitingEndsWhereItsCallerWantsAndWhereNothingCanBeOffered) {
  const auto enough = [] { throw std::runtime_error("waits"); };
  SharedFile first("key", nothing_);
  EXPECT_THROW(SharedFile("key", enough), std::runtime_error);
  first.offer(Descriptor());
  EXPECT_FALSE(SharedFile("key", enough).file().is_open());
}

TEST_F(SharedFiles, ListsThatAreNotTrueAreOfNoUse) {
  const Descriptor file = whole_file();
  const std::string own = std::to_string(getpid()) + " " + std::to_string(file.get());
  for (const std::string& line :
       {own + " 0 0\n", std::string("1 0 1 1\n"), std::string("no list"), std::string(99, '9')}) {
    std::ofstream(folder_ / ("tensorray-" + std::to_string(geteuid()) + "-key")) << line;
    EXPECT_FALSE(SharedFile("key", nothing_).file().is_open()) << line;
  }
}

TEST_F(SharedFiles, WhoCannotShareIsAlone) {
  std::filesystem::create_directory(folder_ / ("tensorray-" + std::to_string(geteuid()) + "-key"));
  SharedFile first("key", nothing_);
  first.offer(whole_file());
  EXPECT_FALSE(SharedFile("key", nothing_).file().is_open());
}

}  // namespace
}  // namespace tensorray
