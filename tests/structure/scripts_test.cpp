// The scripts in tools/, which may install packages, and must not where one only asks what they do.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

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

  fs::path folder_;
};

TEST_F(Scripts, HelpOnlyPrints) {
  int count = 0;
  for (const fs::path& script : test::files_of_project()) {  // Those in tools/ that can be run.
    const bool can_be_run = (fs::status(script).permissions() & fs::perms::owner_exec) != fs::perms::none;
    if (!can_be_run || fs::relative(script, test::source_folder()).string().rfind("tools/", 0) != 0) continue;
    ++count;
    const std::string command = "PATH='" + folder_.string() + "':\"$PATH\" '" + script.string() + "' --help >'" +
                                (folder_ / "printed").string() + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << script;
    std::ifstream printed(folder_ / "printed");
    const std::string text(std::istreambuf_iterator<char>(printed), {});
    EXPECT_NE(text.find(script.filename().string()), std::string::npos) << script << ": " << text;
    EXPECT_EQ(text.find("was called"), std::string::npos) << script << ": " << text;
  }
  EXPECT_GT(count, 10);
}

}  // namespace
}  // namespace tensorray
