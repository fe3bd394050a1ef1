// Errors of users. The program must print one line, end with exit status 1 or 2, and write no file.

#include <regex>

#include <fmt/core.h>
#include <sys/stat.h>

#include "tests/program/support.h"

namespace tensorray {
namespace {

class Errors : public Program {
 protected:
  /// Runs the program, which must fail with `status` and one line on standard error that matches `pattern`.
  void expect_error(int status, const std::string& pattern, const Arguments& arguments,
                    const std::string& shell = "exec") {
    const auto before = files();
    const Outcome outcome = wait_for(start_in(shell, arguments));
    expect_one_line(outcome, "", status);
    EXPECT_TRUE(std::regex_search(outcome.error, std::regex(pattern))) << outcome.error << "\nexpected " << pattern;
    for (const std::string& file : files())  // A render that cannot write its pictures keeps its work.
      if (status == 1 && std::filesystem::path(file).extension() == ".checkpoint")
        std::filesystem::remove(in_folder(file));
    EXPECT_EQ(files(), before);
  }

  void expect_scene_error(int status, const std::string& pattern, const std::string& set) {
    write("scene.json", small_scene());
    expect_error(status, pattern, {"render", "scene.json", "-q", "--set", set});
  }
};

TEST_F(Errors, ScenesAndCommandLines) {
  write("scene.json", small_scene());
  write("empty.json", "");
  write("broken.json", "{\n  \"field\": }");
  write("partial.json", R"({"field": {"file": "a.vdb"}})");
  const std::pair<std::string, Arguments> all[] = {
      {"none.json", {"render", "none.json"}},
      {"empty.json", {"render", "empty.json"}},
      {"broken.json.*line 2", {"render", "broken.json"}},
      {"integrator", {"render", "partial.json"}},
      {"", {}},
      {"photograph", {"photograph"}},
      {"threads", {"render", "scene.json", "--threads", "0"}},
      {"threads", {"render", "scene.json", "--threads", "many"}},
      {"--spp; it is a key of the scene, for --set: integrator.max_samples", {"render", "scene.json", "--spp", "64"}},
      {"--spp=64; it is a key of the scene", {"render", "scene.json", "--spp=64"}},
      {"--width .--help says more.", {"make", "vortex", "-o", "a.vdb", "--width", "9"}},
      {"one kind", {"render", "scene.json", "-o", "a.png", "-o", "b.jpg"}},
      {"--stats.*scene.json", {"render", "scene.json", "--stats", "scene.json"}},
      {"--stats.*a.png", {"render", "scene.json", "-o", "a.png", "--stats", "a.png"}},
      {"one image plane",
       {"render", "scene.json", "--method", "lens", "-o", "a.nii", "--set", "integrator.image_plane.depth=[0.2,0.5]"}},
      {"", {"make", "cheese", "-o", "a.vdb"}},
      {"resolution", {"make", "vortex", "-o", "a.vdb", "--resolution", "0"}},
      {"", {"make", "vortex"}}};
  for (const auto& [pattern, arguments] : all) expect_error(2, pattern, arguments);
  expect_scene_error(2, "unknown key `/lihgt`; did you mean `light`", "lihgt.photons=5");  // tests/scenes has others.
  for (const char* size : {"1e15", "1e300"}) {
    expect_scene_error(2, "/receiver", fmt::format("receiver.size=[{0},{0}]", size));
    expect_scene_error(2, "/light/aperture", fmt::format("light.aperture.size=[{0},{0}]", size));
  }
}

TEST_F(Errors, FieldFiles) {
  run_well({"make", "shear", "-o", "good.vdb", "--resolution", "12"});
  expect_scene_error(1, "good.vdb.*cheese.*shear", R"(field={"file": "good.vdb", "name": "cheese"})");
  write("text.vdb", "this is no VDB");
  for (const std::string file : {"text.vdb", "none.vdb"}) {
    expect_scene_error(1, file, R"(field={"file": ")" + file + "\"}");
    expect_error(1, file, {"info", file});
  }
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

/// Files that end their reader, or that it would read for ever; and those that are missing or open.
TEST_F(Errors, HostileMeshes) {
  expect_scene_error(1, "none.ply", R"(obstacles=[{"file":"none.ply"}])");
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_scene_error(1, "open.obj.*3 open edges|open.obj.*closed", "field.bounds=open.obj");
  std::filesystem::remove(in_folder("open.obj"));
  write("scene.json", R"({"field": {"generate": {"kind": "point_load", "resolution": 5}}, "light": {"photons": 100},
                          "integrator": {"type": "photon_distribution"}, "receiver": {"resolution": [8, 8]}})");
  ASSERT_EQ(mkfifo(in_folder("pipe").c_str(), 0600), 0);
  std::string chain = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [)";
  for (int i = 1; i < 100000; ++i) chain += "{\"children\": [" + std::to_string(i) + "]},";
  const std::pair<std::string, std::string> deep[] = {
      {"nested.gltf", repeated("[", 200000)},
      {"objects.gltf", repeated("{\"a\":", 200000)},
      {"chain.gltf", chain + "{}]}"},
      {"nested.dae",
       "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">"
       "<library_visual_scenes><visual_scene id=\"s\">" +
           repeated("<node>", 50000) + repeated("</node>", 50000) +
           "</visual_scene></library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>"},
      {"nested.fbx", "; FBX 7.4.0 project file\n" + repeated("A: {\n", 100000) + repeated("}\n", 100000)}};
  for (const auto& [name, text] : deep) write(name, text);
  std::filesystem::copy(source_folder() / "tests" / "program" / "hostile_meshes", in_folder(""));
  for (const std::string& name : files())
    if (name != "scene.json" && name != "pipe")
      expect_error(1, name, {"render", "scene.json", "-q", "--set", "obstacles=[{\"file\": \"" + name + "\"}]"});
}

TEST_F(Errors, OutputsThatCannotBeWritten) {
  write("scene.json", small_scene());
  write("occupied", "");
  std::filesystem::create_directory(in_folder("folder.png"));
  for (const char* output : {"none/a.png", "occupied/a.png", "folder.png"})
    expect_error(1, output, {"render", "scene.json", "-q", "-o", output});
  expect_error(1, "none/a.vdb", {"make", "vortex", "-o", "none/a.vdb"});
}

TEST_F(Errors, AFullDiskLeavesTheOldPictureAndNoHalfOne) {
  write("scene.json", small_scene());
  for (const char* name : {"a.png", "a.exr", "a.vdb", "a.vtp", "a.jpg"}) {
    write(name, "old");
    expect_error(1, name, {"render", "scene.json", "-q", "-o", name, "--set", "receiver.resolution=[200,200]"},
                 "ulimit -f 8; exec");
    EXPECT_EQ(read_file(in_folder(name)), "old") << name;
  }
  // A link to a device that is full.
  std::filesystem::create_symlink("/dev/full", in_folder("full.png"));
  expect_error(1, "full.png", {"render", "scene.json", "-q", "-o", "full.png"});
  expect_error(1, "/dev/full", {"make", "helix", "-o", "/dev/full", "--resolution", "24"});
  write("complete.png", "");
  expect_error(1, "/dev/full", {"render", "scene.json", "-q", "-o", "complete.png", "--stats", "/dev/full"});
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace
}  // namespace tensorray
