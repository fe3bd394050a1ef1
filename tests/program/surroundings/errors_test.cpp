// Errors of users. The program must print one line, end with exit status 1 or 2, and write no file.

#include "tests/program/support.h"

namespace tensorray {
namespace {

class Errors : public Program {
 protected:
  void expect_scene_error(const std::string& text, const std::string& change, int status) const {
    write("scene.json", small_scene());
    expect_error(text, {"render", "scene.json", "-q", "--set", change}, status);
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
      {"broken.json: line 2", {"render", "broken.json"}},
      {"integrator", {"render", "partial.json"}},
      {"", {}},
      {"photograph", {"photograph"}},
      {"threads", {"render", "scene.json", "--threads", "0"}},
      {"threads", {"render", "scene.json", "--threads", "many"}},
      {"--spp; it is a key of the scene, for --set: integrator.max_samples", {"render", "scene.json", "--spp", "64"}},
      {"--spp=64; it is a key of the scene", {"render", "scene.json", "--spp=64"}},
      {"--width (--help says more)", {"make", "vortex", "-o", "a.vdb", "--width", "9"}},
      {"one kind", {"render", "scene.json", "-o", "a.png", "-o", "b.jpg"}},
      {"--stats (scene.json)", {"render", "scene.json", "--stats", "scene.json"}},
      {"--stats (a.png)", {"render", "scene.json", "-o", "a.png", "--stats", "a.png"}},
      {"one image plane",
       {"render", "scene.json", "--method", "lens", "-o", "a.nii", "--set", "integrator.image_plane.depth=[0.2,0.5]"}},
      {"", {"make", "cheese", "-o", "a.vdb"}},
      {"resolution", {"make", "vortex", "-o", "a.vdb", "--resolution", "0"}},
      {"", {"make", "vortex"}}};
  for (const auto& [text, arguments] : all) expect_error(text, arguments, 2);
  expect_error("none/a.vdb", {"make", "vortex", "-o", "none/a.vdb"}, 1);
  expect_scene_error("unknown key `/lihgt`; did you mean `light`", "lihgt.photons=5", 2);  // tests/scenes has others.
  for (const char* size : {"1e15", "1e300"}) {
    expect_scene_error("/receiver", fmt::format("receiver.size=[{0},{0}]", size), 2);
    expect_scene_error("/light/aperture", fmt::format("light.aperture.size=[{0},{0}]", size), 2);
  }
}

TEST_F(Errors, FieldFiles) {
  run_well({"make", "shear", "-o", "good.vdb", "--resolution", "12"});
  expect_scene_error("good.vdb: has no tensor field \"cheese\"; there are: shear",
                     R"(field={"file": "good.vdb", "name": "cheese"})", 1);
  write("text.vdb", "this is no VDB");
  for (const std::string file : {"text.vdb", "none.vdb"}) {
    expect_scene_error(file, R"(field={"file": ")" + file + "\"}", 1);
    expect_error(file, {"info", file}, 1);
  }
}

/// Files that end their reader, or that it would read for ever; and those that are missing or open.
TEST_F(Errors, HostileMeshes) {
  expect_scene_error("none.ply", R"(obstacles=[{"file":"none.ply"}])", 1);
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_scene_error("open.obj: the mesh is not closed: it has 3 open edges", "field.bounds=open.obj", 1);
  std::filesystem::remove(in_folder("open.obj"));
  write("scene.json", R"({"field": {"generate": {"kind": "point_load", "resolution": 5}}, "light": {"photons": 100},
                          "integrator": {"type": "photon_distribution"}, "receiver": {"resolution": [8, 8]}})");
  make_pipe("pipe");
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
      expect_error(name, {"render", "scene.json", "-q", "--set", "obstacles=[{\"file\": \"" + name + "\"}]"}, 1);
}

TEST_F(Errors, AFullDiskLeavesTheOldPictureAndNoHalfOne) {
  write("scene.json", small_scene());
  for (const char* name : {"a.png", "a.exr", "a.vdb", "a.vtp", "a.jpg"}) {
    write(name, "old");
    expect_one_line(
        run({"render", "scene.json", "-q", "-o", name, "--set", "receiver.resolution=[200,200]"}, "ulimit -f 8; exec"),
        name, 1);
    EXPECT_EQ(contents(name), "old") << name;
  }
  // A link to a device that is full.
  std::filesystem::create_symlink("/dev/full", in_folder("full.png"));
  expect_one_line(run({"render", "scene.json", "-q", "-o", "full.png"}), "full.png", 1);
  expect_one_line(run({"make", "helix", "-o", "/dev/full", "--resolution", "24"}), "/dev/full", 1);
  expect_one_line(run({"render", "scene.json", "-q", "-o", "complete.png", "--stats", "/dev/full"}), "/dev/full", 1);
  // A render that cannot write its pictures keeps its work.
  EXPECT_THAT(files(), testing::Each(testing::MatchesRegex(
                           "scene.json|(a[.](png|exr|vdb|vtp|jpg)|full[.]png|complete[.]png)([.]checkpoint)?")));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace
}  // namespace tensorray
