#pragma once
/// Temporary files, the data sets, and reading and writing of bytes, for the tests of mesh readers.

#include <stdexcept>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/process/process_limits.h"
#include "tests/data_folder.h"
#include "tests/files.h"

namespace tensorray::test {

/// A folder in the tests' temporary folder that no other process uses. Removed at the end.
class TemporaryFolder : public Temporary {
 public:
  TemporaryFolder() : Temporary("folder") { std::filesystem::create_directories(*this); }
};

}  // namespace tensorray::test

namespace tensorray {

using test::TemporaryFolder;  // Not tensorray::TemporaryFolder itself, which the programs have, too.

inline std::filesystem::path data_file(const std::string& name) { return test::data_folder() / name; }

/// The text with the first `from`, which must be there, replaced.
inline std::string replaced_text(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
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

/// The same in a child process with limits, as the program reads (child_process.h): a reader that a signal ends gives a
/// message, and not the end of all other tests. Other exceptions count as well.
template <typename Act>
std::string error_in_child(const std::filesystem::path& path, Act&& act) {
  const Temporary said("said_by_child");
  const pid_t child = fork();
  if (child == 0) {
    limit_memory();
    const rlimit seconds{60, 60};
    setrlimit(RLIMIT_CPU, &seconds);
    std::string text;
    try {
      text = error_of(act);
    } catch (const std::exception& error) {
      text = error.what();
    }
    write_bytes(said, text);
    _exit(bytes_of(said) == text ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) return path.string() + ": reading it ended the reader";
  EXPECT_EQ(WEXITSTATUS(status), 0);
  std::string text = bytes_of(said);
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  return text;
}

/// Expects that a damaged file is refused with these words, or ends the reader: what VTK does not check depends on its
/// version.
#define EXPECT_DAMAGED(error, words) \
  EXPECT_THAT(error, testing::AnyOf(testing::HasSubstr(words), testing::HasSubstr("ended the reader")))

}  // namespace tensorray

#define SKIP_WITHOUT(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there; TENSORRAY_DATA names its folder"
