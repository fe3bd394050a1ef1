#pragma once
/// @file tests/renderer/support.h
/// Functions that several tests of files and errors share.

#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

namespace tensorray {

inline void write_bytes(const std::filesystem::path& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The message of the exception that `action` throws. Checks that it is one line.
template <class Action>
std::string message(const Action& action) {
  try {
    action();
  } catch (const std::exception& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  }
  return "nothing was thrown";
}

/// A path in the temporary folder of the tests that no other process uses. The destructor removes what is there.
class Temporary {
 public:
  explicit Temporary(const std::string& name)
      : path_(std::filesystem::path(::testing::TempDir()) / ("tensorray_" + std::to_string(getpid()) + "_" + name)) {}
  Temporary(const std::string& name, const std::string& content) : Temporary(name) { write_bytes(path_, content); }
  ~Temporary() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The header of a .ply file of vertices and polygons.
inline std::string ply_header(const std::string& format, int vertices, int faces) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace tensorray
