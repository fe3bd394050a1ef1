// The page of the live view in a real browser, with a real server: tools/viewer/page/test/page_test.mjs.

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/data_folder.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

bool runs(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

TEST(Browser, ThePageFollowsItsUser) {
  const fs::path program(TENSORRAY_VIEW_PROGRAM), page = test::source_folder() / "tools" / "viewer" / "page";
  if (!fs::exists(program.parent_path().parent_path() / "view" / "view.js"))
    GTEST_SKIP() << "the page is not built (tools/viewer/page/build " << program.parent_path().parent_path() / "view"
                 << ")";
  if (!fs::exists(page / "node_modules" / "puppeteer-core")) GTEST_SKIP() << "puppeteer-core is not installed";
  if (!runs("node --version") || !runs("chromium --version")) GTEST_SKIP() << "node or chromium is not installed";
  const fs::path scene = test::source_folder() / "scenes" / "point_load_photons.json";
  const std::string command =
      "node '" + (page / "test" / "page_test.mjs").string() + "' '" + program.string() + "' '" + scene.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace tensorray
