// `tensorray render` of a field without a scene file, and the scene that it saves.

#include <algorithm>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;
using nlohmann::json;

class FieldAlone : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    run_well({"make", "point_load", "-o", "stress.vdb", "--resolution", "17"});
  }

  const std::vector<std::string> small_{"--set", "receiver.resolution=[48,48]", "--set", "light.wavelengths.count=4"};

  std::vector<std::string> with_small(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), small_.begin(), small_.end());
    return arguments;
  }
};

TEST_F(FieldAlone, IsRenderedWithDefaultsAndTheSceneIsToldAndSaved) {
  std::filesystem::create_directory(in_folder("else where"));
  const Outcome outcome =
      run_well(with_small({"render", "stress.vdb", "-o", "alone.png", "--save-scene", "else where/stress.json"}));
  EXPECT_NE(outcome.error.find("scene: {\"field\":"), std::string::npos) << outcome.error;
  const json scene = read_json("else where/stress.json");
  EXPECT_EQ(scene["integrator"]["type"], "photon_distribution");
  EXPECT_EQ(scene["receiver"]["resolution"], json::array({48, 48}));
  run_well({"render", "else where/stress.json", "-o", "again.png", "-q"});
  const std::string picture = read_file(in_folder("alone.png"));
  EXPECT_GT(picture.size(), 1000u);
  // The pictures differ only in the name of the scene in their headers.
  run_well(with_small({"render", "stress.vdb", "-o", "alone.exr", "-q"}));
  run_well({"render", "else where/stress.json", "-o", "again.exr", "-q"});
  EXPECT_EQ(read_image(in_folder("alone.exr")).pixels, read_image(in_folder("again.exr")).pixels);
}

TEST_F(FieldAlone, OtherMethodsAndCommandsTakeIt) {
  run_well(with_small({"render", "stress.vdb", "--set", "integrator.type=lens", "-o", "lens.png", "-q"}));
  run_well({"stretch", "stress.vdb", "-o", "stretch.png", "--pixels", "16", "-q"});
  const Outcome quiet = run_well(with_small({"render", "stress.vdb", "-q"}));
  EXPECT_EQ(quiet.error, "");
  EXPECT_TRUE(exists(in_folder("stress.png")));
  EXPECT_TRUE(exists(in_folder("stress.exr")));
}

TEST_F(FieldAlone, NothingIsOverwrittenOrMadeWrong) {
  const auto expect_error = [&](const std::vector<std::string>& arguments, const std::string& text) {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.status, 0);
    EXPECT_NE(outcome.error.find(text), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  };
  const std::string field = read_file(in_folder("stress.vdb"));
  expect_error({"render", "stress.vdb", "-q", "--save-scene", "stress.vdb"}, "--save-scene");
  expect_error({"render", "stress.vdb", "-q", "-o", "a.png", "--save-scene", "a.png"}, "--save-scene");
  EXPECT_EQ(read_file(in_folder("stress.vdb")), field);
  expect_error({"render", "nothing.vdb", "-q"}, "nothing.vdb");
  write("broken.vdb", "no field");
  expect_error({"render", "broken.vdb", "-q"}, "broken.vdb");
  std::filesystem::create_directory(in_folder("scenes"));
  write("scene.json", R"({ "field": { "file": "stress.vdb" }, "integrator": { "type": "photon_distribution" } })");
  expect_error({"render", "scene.json", "-q", "--save-scene", "scenes/scene.json"}, "must be in the folder of");
  run_well(with_small({"render", "scene.json", "-q", "-o", "b.png", "--save-scene", "small.json"}));
  EXPECT_EQ(read_json("small.json")["field"]["file"], "stress.vdb");
}

}  // namespace
}  // namespace tensorray
