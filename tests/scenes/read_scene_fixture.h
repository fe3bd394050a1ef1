#pragma once
/// Scene files in a folder of their own, and the errors that they give.

#include <fstream>
#include <map>

#include "base/files/temporary_folder.h"
#include "integrators/methods/read_scene.h"
#include "tests/files.h"

namespace tensorray::test {

using Overrides = std::vector<std::string>;
using Files = std::map<std::string, std::filesystem::path>;

inline const char* const smallest = R"({"field": {"file": "a.vdb"}, "integrator": {"type": "photon_distribution"}})";

/// Makes a folder for each test, and removes it after the test.
class ReadScene : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text) const {
    std::filesystem::path path = folder_ / "scene.json";
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

  SceneDescription read(const Overrides& overrides = {}, const std::string& text = smallest) const {
    return read_scene(file(text), {overrides, {}});
  }

  /// The message of the error, which must be one line.
  std::string error(const Overrides& overrides, const std::string& text = smallest) const {
    EXPECT_THROW(read(overrides, text), SceneError) << testing::PrintToString(overrides) << text.substr(0, 200);
    const std::string said = message([&] { read(overrides, text); });
    EXPECT_LT(said.size(), 1000u);
    return said;
  }

  /// Expects an error whose message has a part.
  void refuses(const std::string& part, const Overrides& overrides, const std::string& text = smallest) const {
    EXPECT_THAT(error(overrides, text), HasSubstr(part));
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_ / "";
};

}  // namespace tensorray::test
