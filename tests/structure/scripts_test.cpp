// The scripts in tools/, which may install packages, and must not where one only asks what they do.

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/structure/commands.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// Files in tools/ that can be run.
std::vector<fs::path> scripts() {
  std::vector<fs::path> found;
  for (fs::recursive_directory_iterator entry(test::source_folder() / "tools"), end; entry != end; ++entry) {
    if (entry->path().filename() == "node_modules") entry.disable_recursion_pending();
    if (entry->is_regular_file() && (entry->status().permissions() & fs::perms::owner_exec) != fs::perms::none)
      found.push_back(entry->path());
  }
  return found;
}

/// A folder for the PATH, with programs that install, build or download, and here only fail.
class Scripts : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("tensorray_scripts_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    for (const char* name : {"apt-get", "blender", "cmake", "dpkg-query", "ninja", "npm", "pip", "pip3", "sudo"}) {
      std::ofstream(folder_ / name) << "#!/bin/sh\necho \"$0 was called\" >&2\nexit 1\n";
      fs::permissions(folder_ / name, fs::perms::owner_all);
    }
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// What a script prints with --help, also as errors.
  test::CommandResult help_of(const fs::path& script) const {
    return test::run_command("PATH='" + folder_.string() + "':\"$PATH\" '" + script.string() + "' --help 2>&1");
  }

  fs::path folder_;
};

TEST_F(Scripts, HelpOnlyPrints) {
  const std::vector<fs::path> all = scripts();
  ASSERT_FALSE(all.empty());
  for (const fs::path& script : all) {
    const auto [text, status] = help_of(script);
    EXPECT_EQ(status, 0) << script << ": " << text;
    EXPECT_NE(text.find(script.filename().string()), std::string::npos) << script << ": " << text;
    EXPECT_EQ(text.find("was called"), std::string::npos) << script << ": " << text;
  }
}

}  // namespace
}  // namespace tensorray
