#include <algorithm>
#include <cmath>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

TEST_F(Program, WritesPictureAndExrBesideTheScene) {
  write("scene.json", small_scene());
  const Outcome outcome = run_well({"render", "scene.json"});
  EXPECT_EQ(files(), (std::vector<std::string>{"scene.exr", "scene.json", "scene.png"}));
  EXPECT_NE(outcome.out.find("scene.png"), std::string::npos);
  EXPECT_NE(outcome.error.find("scale"), std::string::npos);  // The program reports what "auto" chose.
  const Image exr = read_image(in_folder("scene.exr"));
  EXPECT_EQ(exr.width, 32);
  EXPECT_EQ(exr.channels, (std::vector<std::string>{"R", "G", "B"}));
}

TEST_F(Program, QuietPrintsNothing) {
  write("scene.json", small_scene());
  const Outcome outcome = run_well({"render", "scene.json", "--quiet"});
  EXPECT_EQ(outcome.out + outcome.error, "");
}

/// Of all options, these change the bytes in no way, or in all.
TEST_F(Program, ThreadsDoNotChangeTheFilesAndTheSeedDoes) {
  write("scene.json", small_scene());
  const auto bytes = [&](const char* threads, const char* seed) {
    run_well({"render", "scene.json", "-q", "-o", "out.exr", "-o", "out.png", "--threads", threads, "--seed", seed,
              "--set", "light.pattern=random"});
    return read_file(in_folder("out.exr")) + read_file(in_folder("out.png"));
  };
  const std::string one = bytes("1", "5");
  EXPECT_TRUE(bytes("2", "5") == one);
  EXPECT_TRUE(bytes("8", "5") == one);
  EXPECT_FALSE(bytes("2", "6") == one);
}

TEST_F(Program, ProvenanceIsInTheHeader) {
  write("scene.json", small_scene());
  run_well({"render", "scene.json", "-q", "-o", "out.exr", "--seed", "77"});
  const std::string bytes = read_file(in_folder("out.exr"));
  for (const char* text : {"tensorray:version", "tensorray:scene", "point_load", "tensorray:seed", "77",
                           "tensorray:photons", "tensorray:ocio_config", "tensorray:color_space"})
    EXPECT_NE(bytes.find(text), std::string::npos) << text;
}

TEST_F(Program, FilesGoThroughMakeInfoAndRender) {
  const Outcome made = run_well({"make", "vortex", "-o", "vortex.vdb", "--resolution", "16", "--circulation", "3"});
  const nlohmann::json info = nlohmann::json::parse(run_well({"info", "vortex.vdb", "--json"}).out);
  EXPECT_NE(info.dump().find("circulation=3"), std::string::npos) << info.dump(2);
  EXPECT_NE(run_well({"info", "vortex.vdb"}).out.find("4096"), std::string::npos);
  write("scene.json", small_scene(R"({"file": "vortex.vdb"})"));
  run_well({"render", "scene.json", "-q"});
  // The same field gives the same picture if it is made in memory.
  const std::vector<float> from_file = read_image(in_folder("scene.exr")).pixels;
  write("scene.json", small_scene(R"({"generate": {"kind": "vortex", "resolution": 16, "circulation": 3}})"));
  run_well({"render", "scene.json", "-q"});
  EXPECT_EQ(read_image(in_folder("scene.exr")).pixels, from_file);
}

TEST_F(Program, AnInterruptLeavesNothingBehind) {
  write("scene.json", small_scene());
  write("scene.png", "an old picture");
  const pid_t child = start({"render", "scene.json", "--set", "light.photons=1e9"});
  // Rendering has begun when the temporary files exist.
  while (files().size() < 4 && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  kill(child, SIGINT);
  const Outcome outcome = wait_for(child);
  EXPECT_EQ(outcome.status, 130);
  EXPECT_EQ(files(), (std::vector<std::string>{"scene.json", "scene.png"}));
  EXPECT_EQ(read_file(in_folder("scene.png")), "an old picture");
}

TEST_F(Program, HelpAndVersion) {
  EXPECT_NE(run_well({"--help"}).out.find("render"), std::string::npos);
  EXPECT_NE(run_well({"render", "--help"}).out.find("--set"), std::string::npos);
  EXPECT_NE(run_well({"make", "vortex", "--help"}).out.find("--circulation"), std::string::npos);
  EXPECT_EQ(run_well({"--version"}).out.find("tensorray "), 0u);
  EXPECT_TRUE(nlohmann::json::parse(run_well({"schema"}).out).contains("$schema"));
}

}  // namespace
}  // namespace tensorray
