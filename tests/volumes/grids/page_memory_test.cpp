// Arrays in files: they keep their bytes, take no memory of the process's own, and leave nothing behind.

#include "volumes/grids/page_memory.h"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"
#include "tests/volumes/file_size_limit.h"

namespace tensorray {
namespace {

constexpr std::size_t large = std::size_t{64} << 20;

/// Memory of the process that is not a file's, bytes.
std::size_t own_bytes() {
  std::size_t all = 0, resident = 0, shared = 0;
  std::ifstream("/proc/self/statm") >> all >> resident >> shared;
  return (resident - shared) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

using Bytes = std::vector<char, PageAllocator<char>>;

char content_of(std::size_t i) { return static_cast<char>(i / 4096 % 251 + 1); }

/// @return what went wrong; empty: nothing.
std::string use_files(const std::filesystem::path& folder) {
  bound_memory(large, folder);
  const std::size_t before = own_bytes();
  Bytes bytes(large);
  for (std::size_t i = 0; i < large; ++i) bytes[i] = content_of(i);
  const Bytes copy = bytes;
  release_pages(bytes.data() + large / 2, large / 2);
  for (std::size_t i = 0; i < large; ++i)
    if (copy[i] != content_of(i) || (i < large / 2 && bytes[i] != copy[i])) return "a byte is lost";
#ifndef TENSORRAY_SANITIZED
  if (own_bytes() > before + large / 4) return "memory of its own: " + std::to_string(own_bytes() - before);
#endif
  if (!std::filesystem::is_empty(folder)) return "the folder has a file";
  const FileSizeLimit full(large / 2);
  try {
    const Bytes more(large);
    return "a full disk is not noticed";
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    const bool is_line = text.find('\n') == std::string::npos;
    return is_line && text.find("--memory: " + folder.string()) == 0 ? "" : text;
  }
}

/// In a new process, as the bound stays.
TEST(PageMemory, WithABoundIsThatOfFilesWithoutNames) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto use = [] {
    const TemporaryFolder folder;
    std::cerr << "[" << use_files(folder / "") << "]";
  };
  EXPECT_EXIT((use(), _exit(0)), ::testing::ExitedWithCode(0), R"(\[\])");
}

}  // namespace
}  // namespace tensorray
