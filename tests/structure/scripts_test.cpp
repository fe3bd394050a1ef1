// The scripts in tools/, which may install packages, and must not where one only asks what they do. Most of them run in
// no test, as they would build.

#include <cstdlib>
#include <regex>

#include "tests/structure/sources.h"

namespace tensorray {
namespace {

/// A folder for the PATH, with programs that install, build or download, and here only fail.
class Scripts : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"apt-get", "blender", "cmake", "dpkg-query", "ninja", "npm", "pip", "pip3", "sudo"}) {
      write_bytes(folder_ / name, "#!/bin/sh\necho \"$0 was called\" >&2\nexit 1\n");
      std::filesystem::permissions(folder_ / name, std::filesystem::perms::owner_all);
    }
  }

  const Temporary folder_{"scripts"};
};

TEST_F(Scripts, HelpOnlyPrints) {
  int count = 0;
  for (const std::filesystem::path& script : test::files_of_project()) {  // Those in tools/ that can be run.
    const bool can_be_run = (std::filesystem::status(script).permissions() & std::filesystem::perms::owner_exec) !=
                            std::filesystem::perms::none;
    if (!can_be_run || std::filesystem::relative(script, test::source_folder()).string().rfind("tools/", 0) != 0)
      continue;
    ++count;
    const std::string command = "PATH='" + folder_.string() + "':\"$PATH\" '" + script.string() + "' --help >'" +
                                (folder_ / "printed").string() + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << script;
    const std::string text = bytes_of(folder_ / "printed");
    EXPECT_NE(text.find(script.filename().string()), std::string::npos) << script << ": " << text;
    EXPECT_EQ(text.find("was called"), std::string::npos) << script << ": " << text;
  }
  EXPECT_GT(count, 10);
}

/// Scripts and pages name only parts of tools/setup that there are.
TEST_F(Scripts, NamePartsOfSetupThatThereAre) {
  const std::string setup = bytes_of(test::source_folder() / "tools" / "setup");
  const std::size_t begin = setup.find("case $part in\n");
  ASSERT_NE(begin, std::string::npos);
  const std::string labels = setup.substr(begin, setup.find("esac", begin) - begin);
  static const std::regex label(R"(\n    ([a-z_|* -]+[a-z_*])\))"), star(R"(\*)"), space(" ");
  std::string names = "none";
  for (std::sregex_iterator match(labels.begin(), labels.end(), label), end; match != end; ++match)
    names += "|" + std::regex_replace(std::regex_replace((*match)[1].str(), space, ""), star, "[a-z_]+");
  const std::regex part(names);
  EXPECT_TRUE(std::regex_match("render", part) && std::regex_match("base_tests", part));
  EXPECT_FALSE(std::regex_match("nothing", part)) << names;

  std::vector<std::filesystem::path> files = test::files_of_project();
  files.push_back(test::source_folder() / ".ci" / "run");
  static const std::regex call(R"(/setup"? ("\$\w+"|release|debug|asan-ubsan|tsan)((?: [a-z_-]+)+)($|[`;|&\n]))");
  static const std::regex word("[a-z_-]+");
  std::size_t calls = 0;
  for (const std::filesystem::path& file : files) {
    if (file.extension() != ".md" && !file.extension().empty()) continue;
    const std::string text = bytes_of(file);
    for (std::sregex_iterator match(text.begin(), text.end(), call), end; match != end; ++match, ++calls) {
      const std::string named = (*match)[2];
      for (std::sregex_iterator name(named.begin(), named.end(), word); name != end; ++name)
        EXPECT_TRUE(std::regex_match(name->str(), part)) << file << ": " << name->str();
    }
  }
  EXPECT_GT(calls, 8u);
}

}  // namespace
}  // namespace tensorray
