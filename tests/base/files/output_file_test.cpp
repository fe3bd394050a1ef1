#include "base/files/output_file.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files/descriptor.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

template <class Work>
std::string error_of(Work work) {
  try {
    work();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

class OutputFileTest : public ::testing::Test {
 protected:
  OutputFileTest() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / ("output_file_" + std::to_string(getpid()) + "_" + test->name());
    fs::create_directories(folder_);
  }
  ~OutputFileTest() override { fs::remove_all(folder_); }

  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_)) all.push_back(entry.path().filename().string());
    std::sort(all.begin(), all.end());
    return all;
  }

  fs::path folder_;
};

TEST_F(OutputFileTest, AppearsWhenCommitted) {
  OutputFile file(folder_ / "a.spectral.exr");
  EXPECT_EQ(file.path().parent_path(), fs::canonical(folder_)) << "renaming works within one file system only";
  EXPECT_EQ(file.path().extension(), ".exr");
  write(file.path(), "new");
  EXPECT_FALSE(fs::exists(file.target()));
  file.commit();
  EXPECT_EQ(text_of(folder_ / "a.spectral.exr"), "new");
  EXPECT_EQ(names().size(), 1u) << "no temporary is left";
}

/// As of a shell's `>> log`: the file is not replaced, but gets more bytes.
TEST_F(OutputFileTest, AppendsToWhatTheProcessHasOpen) {
  const Descriptor log = open_file(folder_ / "log", O_WRONLY | O_CREAT);
  ASSERT_TRUE(write_whole(log.get(), "before, "));
  const std::string number = std::to_string(log.get());
  const std::vector<std::string> folders{"/proc/self/fd/", "/dev/fd/", "/dev/./fd/"};
  for (const std::string& folder : folders) {
    fs::create_symlink(folder + number, folder_ / "link");
    for (const fs::path& target : {fs::path(folder + number), folder_ / "link"}) {
      OutputFile file(target);
      write(file.path(), "more, ");
      file.commit();
    }
    fs::remove(folder_ / "link");
  }
  EXPECT_EQ(text_of(folder_ / "log"), "before, more, more, more, more, more, more, ");
  const Descriptor reading = open_file(folder_ / "log", O_RDONLY);
  EXPECT_THROW(OutputFile("/dev/fd/" + std::to_string(reading.get())), std::runtime_error);
}

TEST_F(OutputFileTest, LeavesTheOldFileUntilCommitted) {
  write(folder_ / "a.png", "old");
  {
    OutputFile file(folder_ / "a.png");
    write(file.path(), "half");
    EXPECT_EQ(text_of(folder_ / "a.png"), "old");
  }
  EXPECT_EQ(text_of(folder_ / "a.png"), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"a.png"});
}

TEST_F(OutputFileTest, TwoOfOneTargetDoNotMeet) {
  OutputFile first(folder_ / "a.png"), second(folder_ / "a.png");
  EXPECT_NE(first.path(), second.path());
}

TEST_F(OutputFileTest, Moves) {
  std::vector<OutputFile> files;
  files.emplace_back(folder_ / "a.png");
  files.emplace_back(folder_ / "b.png");
  files.erase(files.begin());
  ASSERT_EQ(names().size(), 1u) << "the temporary of a.png is gone, that of b.png is not";
  write(files[0].path(), "b");
  commit_all(files);
  EXPECT_EQ(names(), std::vector<std::string>{"b.png"});
  EXPECT_THROW(files[0].commit(), std::logic_error);
}

TEST_F(OutputFileTest, NewFilesHaveThePermissionsOfTheMask) {
  const mode_t before = umask(027);
  OutputFile file(folder_ / "a.png");
  umask(before);
  file.commit();
  EXPECT_EQ(static_cast<unsigned>(fs::status(folder_ / "a.png").permissions()), 0640u);
}

TEST_F(OutputFileTest, FollowsLinks) {
  fs::create_directories(folder_ / "elsewhere");
  write(folder_ / "elsewhere" / "real.png", "old");
  fs::create_symlink("elsewhere/real.png", folder_ / "link.png");
  fs::create_symlink("elsewhere/none.png", folder_ / "dangling.png");
  for (const char* name : {"link.png", "dangling.png"}) {
    OutputFile file(folder_ / name);
    write(file.path(), "new");
    file.commit();
    EXPECT_TRUE(fs::is_symlink(folder_ / name));
  }
  EXPECT_EQ(text_of(folder_ / "elsewhere" / "real.png"), "new");
  EXPECT_EQ(text_of(folder_ / "elsewhere" / "none.png"), "new");
}

TEST_F(OutputFileTest, CopiesIntoPipes) {
  const fs::path pipe = folder_ / "pipe.png";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string sent(300000, 'x');  // More than the buffer of a pipe.
  OutputFile file(pipe);
  write(file.path(), sent);
  std::string received;
  std::thread reader([&] { received = text_of(pipe); });
  file.commit();
  reader.join();
  EXPECT_EQ(received, sent);
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST_F(OutputFileTest, AFullDeviceIsAnErrorAndStaysADevice) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  fs::create_symlink("/dev/full", folder_ / "full.png");
  fs::path temporary;
  const std::string error = error_of([&] {
    OutputFile file(folder_ / "full.png");
    temporary = file.path();
    EXPECT_EQ(temporary.extension(), ".png");
    write(temporary, "anything");
    file.commit();
  });
  EXPECT_THAT(error, HasSubstr("full.png: cannot be written: No space left"));
  EXPECT_FALSE(fs::exists(temporary));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "full.png"));
}

TEST_F(OutputFileTest, DevicesAreFirst) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  write(folder_ / "a.png", "old");
  std::vector<OutputFile> files;
  files.emplace_back(folder_ / "a.png");
  files.emplace_back("/dev/full");
  for (const OutputFile& file : files) write(file.path(), "new");
  EXPECT_THROW(commit_all(files), std::runtime_error);
  EXPECT_EQ(text_of(folder_ / "a.png"), "old");
}

TEST_F(OutputFileTest, AllFilesChangeOrNone) {
  write(folder_ / "a", "old a");
  write(folder_ / "c", "old c");
  fs::create_directories(folder_ / "other");
  std::vector<OutputFile> files;
  files.emplace_back(folder_ / "a");
  files.emplace_back(folder_ / "b");
  files.emplace_back(folder_ / "other/d");
  files.emplace_back(folder_ / "c");
  for (const OutputFile& file : files) write(file.path(), "new");
  fs::remove(files[2].path());  // The third of four cannot take its name.
  EXPECT_THROW(commit_all(files), std::runtime_error);
  files.clear();
  EXPECT_EQ(text_of(folder_ / "a"), "old a");
  EXPECT_EQ(text_of(folder_ / "c"), "old c");
  EXPECT_THAT(names(), ::testing::ElementsAre("a", "c", "other"));
  EXPECT_TRUE(fs::is_empty(folder_ / "other"));
}

TEST_F(OutputFileTest, CommittingSeveralFilesLeavesNothingElse) {
  write(folder_ / "a", "old");
  fs::permissions(folder_ / "a", fs::perms::owner_read | fs::perms::owner_write);
  std::vector<OutputFile> files;
  files.emplace_back(folder_ / "a");
  files.emplace_back(folder_ / "b");
  for (const OutputFile& file : files) write(file.path(), "new");
  commit_all(files);
  EXPECT_EQ(text_of(folder_ / "a"), "new");
  EXPECT_EQ(text_of(folder_ / "b"), "new");
  EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THAT(names(), ::testing::ElementsAre("a", "b"));
}

TEST_F(OutputFileTest, TargetsThatCannotBe) {
  write(folder_ / "file", "");
  fs::create_symlink("loop", folder_ / "loop");
  EXPECT_THAT(error_of([&] { OutputFile file(folder_); }), HasSubstr("is a folder; give the name of a file"));
  EXPECT_THAT(error_of([&] { OutputFile file(folder_ / "x/"); }), HasSubstr("is a folder"));
  EXPECT_THAT(error_of([&] { OutputFile file(folder_ / "no/a.png"); }), HasSubstr("there is no folder"));
  EXPECT_THAT(error_of([&] { OutputFile file(folder_ / "file/a.png"); }), HasSubstr("there is no folder"));
  EXPECT_THAT(error_of([&] { OutputFile file(folder_ / "loop"); }), HasSubstr("loop of symbolic links"));
  EXPECT_THAT(error_of([&] { OutputFile file(""); }), HasSubstr("name of a file"));
}

TEST_F(OutputFileTest, WriteProtection) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  write(folder_ / "a.png", "old");
  fs::permissions(folder_ / "a.png", fs::perms::owner_read);
  EXPECT_THAT(error_of([&] { OutputFile file(folder_ / "a.png"); }), HasSubstr("Permission denied"));
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THAT(error_of([&] { OutputFile file(folder_ / "b.png"); }), HasSubstr("cannot write to the folder"));
  fs::permissions(folder_, fs::perms::owner_all);
}

}  // namespace
}  // namespace tensorray
