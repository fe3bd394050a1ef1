#pragma once
/// For all tests: the bytes of files, files that vanish by themselves, full disks, and the messages of errors.

#include <csignal>
#include <exception>
#include <fstream>
#include <iterator>

#include <sys/resource.h>
#include <unistd.h>

#include "tests/names.h"

namespace tensorray {

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Makes the file's folder, too.
inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << bytes;
}

/// A path in the tests' temporary folder that no other process uses. The destructor removes what is there.
class Temporary : public std::filesystem::path {
 public:
  explicit Temporary(const std::string& name)
      : std::filesystem::path(std::filesystem::path(::testing::TempDir()) /
                              ("tensorray_" + std::to_string(::getpid()) + "_" + name)) {}
  Temporary(const std::string& name, const std::string& bytes) : Temporary(name) { write_bytes(*this, bytes); }
  ~Temporary() {
    std::error_code ignored;
    std::filesystem::remove_all(*this, ignored);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  const std::filesystem::path& path() const { return *this; }
};

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

/// While it exists, files cannot grow beyond `bytes`; writing then fails as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

}  // namespace tensorray
