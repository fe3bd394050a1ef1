// Descriptors, whole writes, and files without names.

#include "base/files/descriptor.h"

#include <cerrno>
#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"

namespace tensorray {
namespace {

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
  EXPECT_TRUE(std::filesystem::is_empty(folder / ""));
  EXPECT_TRUE(write_whole(file.get(), "text"));
  EXPECT_FALSE(open_unnamed(folder / "none").is_open());
  const UnnamedFile shared;
  std::ofstream(shared.path()) << "shared";
  std::ifstream again(shared.path());
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(again), {}), "shared");
}

}  // namespace
}  // namespace tensorray
