#include "base/files/output_file.h"

#include <cerrno>
#include <fstream>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files/descriptor.h"
#include "base/files/temporary_folder.h"
#include "base/text/content_hash.h"
#include "tests/files.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public ::testing::Test {
 protected:
  std::set<std::string> names() const {
    std::set<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder_)) all.insert(entry.path().filename().string());
    return all;
  }

  std::vector<OutputFile> written(const std::vector<fs::path>& targets) const {
    std::vector<OutputFile> files;
    for (const fs::path& target : targets) files.emplace_back(folder_ / target);
    for (const OutputFile& file : files) write_bytes(file.path(), "new");
    return files;
  }

  static void replace(const fs::path& target, const std::string& bytes) {
    OutputFile file(target);
    write_bytes(file.path(), bytes);
    file.commit();
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_ / "";
};

TEST_F(OutputFileTest, ChangesWhenCommitted) {
  const fs::path name = "a.spectral.exr";
  for (const std::string old : {"", "old"})
    for (const bool is_committed : {false, true}) {
      fs::remove(folder_ / name);
      if (!old.empty()) write_bytes(folder_ / name, old);
      {
        OutputFile file(folder_ / name);
        EXPECT_EQ(file.path().parent_path(), fs::canonical(folder_)) << "renaming works within one file system only";
        EXPECT_EQ(file.path().extension(), ".exr");
        write_bytes(file.path(), "new");
        EXPECT_NE(OutputFile(folder_ / name).path(), file.path()) << "two of one target do not meet";
        EXPECT_EQ(fs::exists(file.target()), !old.empty());
        if (is_committed) file.commit();
      }
      const std::string expected = is_committed ? "new" : old;
      EXPECT_EQ(fs::exists(folder_ / name) ? bytes_of(folder_ / name) : "", expected);
      EXPECT_EQ(names().size(), expected.empty() ? 0u : 1u) << "no temporary is left";
    }
}

/// As of a shell's `>> log`: the file is not replaced, but gets more bytes.
TEST_F(OutputFileTest, AppendsToWhatTheProcessHasOpen) {
  const Descriptor log = open_file(folder_ / "log", O_WRONLY | O_CREAT);
  ASSERT_TRUE(write_whole(log.get(), "before, "));
  const std::string number = std::to_string(log.get());
  for (const std::string folder : {"/proc/self/fd/", "/dev/fd/", "/dev/./fd/"}) {
    fs::create_symlink(folder + number, folder_ / "link");
    for (const fs::path& target : {fs::path(folder + number), folder_ / "link"}) replace(target, "more, ");
    fs::remove(folder_ / "link");
  }
  EXPECT_EQ(bytes_of(folder_ / "log"), "before, more, more, more, more, more, more, ");
  const Descriptor reading = open_file(folder_ / "log", O_RDONLY);
  EXPECT_THROW(OutputFile("/dev/fd/" + std::to_string(reading.get())), std::runtime_error);
}

TEST_F(OutputFileTest, Moves) {
  std::vector<OutputFile> files = written({"a.png", "b.png"});
  files.erase(files.begin());
  ASSERT_EQ(names().size(), 1u) << "the temporary of a.png is gone, that of b.png is not";
  commit_all(files);
  EXPECT_THAT(names(), ElementsAre("b.png"));
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
  write_bytes(folder_ / "elsewhere" / "real.png", "old");
  fs::create_symlink("elsewhere/real.png", folder_ / "link.png");
  fs::create_symlink("elsewhere/none.png", folder_ / "dangling.png");
  for (const char* name : {"link.png", "dangling.png"}) {
    replace(folder_ / name, "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / name));
  }
  EXPECT_EQ(bytes_of(folder_ / "elsewhere" / "real.png"), "new");
  EXPECT_EQ(bytes_of(folder_ / "elsewhere" / "none.png"), "new");
}

TEST_F(OutputFileTest, CopiesIntoPipes) {
  const fs::path pipe = folder_ / "pipe.png";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string sent(300000, 'x');  // More than the buffer of a pipe.
  OutputFile file(pipe);
  write_bytes(file.path(), sent);
  std::string received;
  std::thread reader([&] { received = bytes_of(pipe); });
  file.commit();
  reader.join();
  EXPECT_EQ(received, sent);
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST_F(OutputFileTest, AFullDeviceIsAnErrorAndStaysADevice) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  fs::create_symlink("/dev/full", folder_ / "full.png");
  fs::path temporary;
  const std::string error = message([&] {
    OutputFile file(folder_ / "full.png");
    temporary = file.path();
    EXPECT_EQ(temporary.extension(), ".png");
    write_bytes(temporary, "anything");
    file.commit();
  });
  EXPECT_THAT(error, HasSubstr("full.png: cannot be written: No space left"));
  EXPECT_FALSE(fs::exists(temporary));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "full.png"));
}

TEST_F(OutputFileTest, DevicesAreFirst) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  write_bytes(folder_ / "a.png", "old");
  std::vector<OutputFile> files = written({"a.png", "/dev/full"});
  EXPECT_THROW(commit_all(files), std::runtime_error);
  EXPECT_EQ(bytes_of(folder_ / "a.png"), "old");
}

TEST_F(OutputFileTest, AllFilesChangeOrNone) {
  write_bytes(folder_ / "a", "old a");
  write_bytes(folder_ / "c", "old c");
  fs::create_directories(folder_ / "other");
  std::vector<OutputFile> files = written({"a", "b", "other/d", "c"});
  fs::remove(files[2].path());  // The third of four cannot take its name.
  EXPECT_THROW(commit_all(files), std::runtime_error);
  files.clear();
  EXPECT_EQ(bytes_of(folder_ / "a"), "old a");
  EXPECT_EQ(bytes_of(folder_ / "c"), "old c");
  EXPECT_THAT(names(), ElementsAre("a", "c", "other"));
  EXPECT_TRUE(fs::is_empty(folder_ / "other"));
}

TEST_F(OutputFileTest, CommittingSeveralFilesLeavesNothingElse) {
  write_bytes(folder_ / "a", "old");
  fs::permissions(folder_ / "a", fs::perms::owner_read | fs::perms::owner_write);
  std::vector<OutputFile> files = written({"a", "b"});
  commit_all(files);
  EXPECT_EQ(bytes_of(folder_ / "a"), "new");
  EXPECT_EQ(bytes_of(folder_ / "b"), "new");
  EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THAT(names(), ElementsAre("a", "b"));
}

TEST_F(OutputFileTest, TargetsThatCannotBe) {
  write_bytes(folder_ / "file", "");
  fs::create_symlink("loop", folder_ / "loop");
  const std::vector<std::pair<fs::path, const char*>> cases{
      {folder_, "is a folder; give the name of a file"}, {folder_ / "x/", "is a folder"},
      {folder_ / "no/a.png", "there is no folder"},      {folder_ / "file/a.png", "there is no folder"},
      {folder_ / "loop", "loop of symbolic links"},      {"", "name of a file"}};
  for (const auto& [target, error] : cases)
    EXPECT_THAT(message([target = target] { OutputFile file(target); }), HasSubstr(error));
}

TEST_F(OutputFileTest, WriteProtection) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  write_bytes(folder_ / "a.png", "old");
  fs::permissions(folder_ / "a.png", fs::perms::owner_read);
  EXPECT_THAT(message([&] { OutputFile file(folder_ / "a.png"); }), HasSubstr("Permission denied"));
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THAT(message([&] { OutputFile file(folder_ / "b.png"); }), HasSubstr("cannot write to the folder"));
  fs::permissions(folder_, fs::perms::owner_all);
}

TEST(ReplaceFileTest, WritesAllOrNothing) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a";
  replace_file(file, {"one ", "two"});
  EXPECT_EQ(bytes_of(file), "one two");
  std::ofstream(folder / "a.new") << "somebody's";
  const fs::path beside = folder / fmt::format(".tensorray-{:016x}.new", content_hash(file.filename().string()));
  std::ofstream(beside) << "what a killed process left, which is longer than the next";
  replace_file(file, {"three"});
  EXPECT_EQ(bytes_of(file), "three");
  EXPECT_EQ(bytes_of(folder / "a.new"), "somebody's");
  EXPECT_FALSE(fs::exists(beside));
  fs::create_symlink("a.new", beside);
  EXPECT_THROW(replace_file(file, {"four"}), std::runtime_error);
  EXPECT_EQ(bytes_of(folder / "a.new"), "somebody's");
  EXPECT_THROW(replace_file(folder / "none" / "a", {"x"}), std::runtime_error);
  const FileSizeLimit full(0);
  EXPECT_THROW(replace_file(folder / "full", {"x"}), std::runtime_error);
  EXPECT_FALSE(fs::exists(folder / "full"));
}

bool is_open(int descriptor) { return fcntl(descriptor, F_GETFD) >= 0; }

TEST(DescriptorTest, BelongsToOneOwner) {
  Descriptor first = open_file("/dev/null", O_WRONLY);
  const int value = first.get();
  EXPECT_TRUE(is_open(value));
  EXPECT_NE(fcntl(value, F_GETFD) & FD_CLOEXEC, 0);
  {
    Descriptor second = std::move(first);
    EXPECT_FALSE(first.is_open());
    second = open_file("/dev/zero", O_RDONLY);
    EXPECT_FALSE(is_open(value));
    EXPECT_TRUE(second.close() && second.close());
  }
  EXPECT_FALSE(open_file("/none/none", O_RDONLY).is_open());
  EXPECT_EQ(errno, ENOENT);
}

/// A pipe takes 64 KiB at once, and a signal interrupts.
TEST(DescriptorTest, WritesAreWhole) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const Descriptor reader(ends[0]);
  Descriptor writer(ends[1]);
  const std::string sent(1 << 20, 'x');
  std::size_t received = 0;
  std::thread other([&] {
    char buffer[1000];
    for (ssize_t size = 0; (size = read(reader.get(), buffer, sizeof buffer)) > 0;)
      received += static_cast<std::size_t>(size);
  });
  EXPECT_TRUE(write_whole(writer.get(), sent));
  writer.close();
  other.join();
  EXPECT_EQ(received, sent.size());
  const Descriptor full = open_file("/dev/full", O_WRONLY);
  EXPECT_FALSE(write_whole(full.get(), "x"));
  EXPECT_EQ(errno, ENOSPC);
  EXPECT_TRUE(write_whole(-1, ""));
  EXPECT_FALSE(write_whole(-1, "x"));
}

TEST(DescriptorTest, UnnamedFilesHaveNoName) {
  const TemporaryFolder folder;
  const Descriptor file = open_unnamed(folder / "");
  ASSERT_TRUE(file.is_open());
  EXPECT_TRUE(fs::is_empty(folder / ""));
  EXPECT_TRUE(write_whole(file.get(), "text"));
  EXPECT_FALSE(open_unnamed(folder / "none").is_open());
  const UnnamedFile shared;
  write_bytes(shared.path(), "shared");
  EXPECT_EQ(bytes_of(shared.path()), "shared");
}

}  // namespace
}  // namespace tensorray
