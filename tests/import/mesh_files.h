#pragma once
/// @file tests/import/mesh_files.h
/// Temporary files, the data sets, and reading and writing of bytes, for the tests of mesh readers.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/data_folder.h"

namespace tensorray::test {

/// A folder in the tests' temporary folder that no other process uses. Removed at the end.
class TemporaryFolder : public std::filesystem::path {
 public:
  TemporaryFolder() : path(testing::TempDir()) {
    const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
    *this /= "tensorray_" + std::to_string(::getpid()) + "_" + test->test_suite_name() + "_" + test->name();
    std::filesystem::create_directories(*this);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(*this); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

}  // namespace tensorray::test

namespace tensorray {

using test::TemporaryFolder;  // Not tensorray::TemporaryFolder itself, which the programs have, too.

inline std::filesystem::path data_file(const std::string& name) { return test::data_folder() / name; }

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

/// The message of the std::runtime_error that `act` throws, which must be one line; empty if it throws nothing.
template <typename Act>
std::string error_of(Act&& act) {
  try {
    act();
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  }
  return {};
}

}  // namespace tensorray

#define SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there; TENSORRAY_DATA names its folder"
