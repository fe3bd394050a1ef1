// The files that scenes name, read and write.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <sys/stat.h>

#include "scenes/description/check_scene.h"
#include "tests/scenes/read_scene_fixture.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;
using namespace test;
using ::testing::EndsWith;
using ::testing::HasSubstr;

/// A path is any bytes. The scene's text, which is kept in files and read again, has them as UTF-8.
TEST_F(ReadScene, PathsOfAnyBytesComeBack) {
  const std::string name = "u\xff\xc3(.vdb";
  const SceneDescription scene = read({"field.file=" + name});
  EXPECT_EQ(scene.field.file, folder_ / name);
  const SceneDescription again = read_scene_json(parse_value(scene.text), scene.path);
  EXPECT_EQ(again.field.file, folder_ / name);
  const SceneDescription config = read({"output.ocio=/tmp/" + name});
  EXPECT_EQ(config.output.ocio, "/tmp/" + name);
  EXPECT_EQ(read_scene_json(parse_value(config.text), config.path).output.ocio, "/tmp/" + name);
  const SceneDescription alone = read_scene("/tmp/" + name, {});
  EXPECT_EQ(alone.field.file, "/tmp/" + name);
}

TEST_F(ReadScene, OutputsNeverOverwriteEachOtherOrAnInput) {
  EXPECT_THAT(error({"output.exr=a.exr", "output.spectral=./x/../a.exr"}), HasSubstr("same file as `/output/exr`"));
  EXPECT_THAT(error({"output.photons=a.vdb"}),
              HasSubstr("`/output/photons` (" + (folder_ / "a.vdb").string() + ") is the same file as `/field/file`"));
  EXPECT_NO_THROW(read({"output.exr=a.exr", "output.spectral=b/a.exr", "output.photons=b.vdb"}));
}

TEST_F(ReadScene, OutputsOfTheCommandLineTakeThePlaceOfTheScenes) {
  const auto files_of = [this](const std::vector<fs::path>& outputs, const Overrides& overrides = {}) {
    return read_scene(file(smallest), {overrides, outputs}).output.files;
  };
  EXPECT_EQ(files_of({"/a/b.jpg", "/a/c.spectral.exr"}, {"output.exr=d.exr"}),
            (Files{{"image", "/a/b.jpg"}, {"spectral", "/a/c.spectral.exr"}}));
  EXPECT_EQ(files_of({"/a.vdb", "/a.fluence.vdb"}), (Files{{"photons", "/a.vdb"}, {"fluence", "/a.fluence.vdb"}}));
  EXPECT_EQ(files_of({"/a.vtp"}), (Files{{"photons", "/a.vtp"}}));
  EXPECT_EQ(files_of({"/a.vtp"}, {"integrator.type=path_tracing"}), (Files{{"paths", "/a.vtp"}}));
  EXPECT_EQ(files_of({"/a.vdb"}, {"integrator.type=stretch"}), (Files{{"stretch", "/a.vdb"}}));
  EXPECT_EQ(files_of({"a.png"}), (Files{{"image", fs::absolute("a.png")}}));
  const auto refusal = [&](const std::vector<fs::path>& outputs, const Overrides& overrides = {}) -> std::string {
    try {
      files_of(outputs, overrides);
    } catch (const SceneError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal({"a.png", "b.jpg"}), HasSubstr("one kind"));
  EXPECT_THAT(refusal({"a.gif"}), HasSubstr(".png, .jpg"));
  EXPECT_THAT(refusal({"a.vdb"}, {"integrator.type=lens"}), HasSubstr("lens makes no photons"));
}

/// input_files lists every key that names a file, and an output is refused under any name of the same file.
TEST_F(ReadScene, NoOutputTakesThePlaceOfAnInput) {
  for (const char* name : {"body.ply", "cut.ply", "photo.png", "sky.exr", "lamp.txt", "config.ocio", "seeds.txt"})
    std::ofstream(folder_ / name) << name;
  fs::create_directories(folder_ / "folder");
  const Overrides inputs{"obstacles=[{\"file\":\"body.ply\"}]",
                         "field.bounds=cut.ply",
                         "integrator.image=photo.png",
                         "lights=[{\"kind\":\"environment\",\"file\":\"sky.exr\"}]",
                         "light.spectrum=lamp.txt",
                         "output.ocio=config.ocio",
                         "integrator.seeds={\"kind\":\"file\",\"file\":\"seeds.txt\"}"};
  unsetenv("OCIO");
  const SceneDescription scene = read(inputs);
  for (const NamedFile& input : input_files(scene)) {
    if (!fs::exists(input.path)) continue;
    const fs::path hard = folder_ / "hard_link", soft = folder_ / "soft_link";
    fs::remove(hard);
    fs::remove(soft);
    fs::create_hard_link(input.path, hard);
    fs::create_symlink(input.path.filename(), soft);
    for (const fs::path& output : {input.path, folder_ / "folder/.." / input.path.filename(), hard, soft})
      EXPECT_THROW(check_files(scene, {{output, "--stats"}}), SceneError) << input.name << " by " << output;
  }
  EXPECT_EQ(input_files(scene).size(), 10u) << "a new kind of input belongs into this test";
  EXPECT_NO_THROW(check_files(scene, {{folder_ / "new.json", "--stats"}}));
  EXPECT_NO_THROW(check_files(scene, {{"/dev/stdout", "--stats"}}));

  // To open a pipe may take for ever. Only the scene itself may come through one.
  for (const NamedFile& input : input_files(scene)) {
    if (!fs::exists(input.path)) continue;
    const fs::path aside = folder_ / "aside";
    fs::rename(input.path, aside);
    ASSERT_EQ(mkfifo(input.path.c_str(), 0600), 0);
    std::string refusal;
    try {
      check_files(scene, {});
    } catch (const SceneError& error) {
      refusal = error.what();
    }
    EXPECT_EQ(refusal.find("is a pipe or a device") != std::string::npos, input.path != scene.path) << input.name;
    fs::remove(input.path);
    fs::rename(aside, input.path);
  }
}

/// A config that is not read is no input, which its file would have to exist for.
TEST_F(ReadScene, TheConfigOfTheEnvironmentIsAnInputWhereItIsRead) {
  setenv("OCIO", "/no/such.ocio", 1);
  const auto reads_it = [&](const Overrides& overrides) {
    const std::vector<NamedFile> files = input_files(read(overrides));
    return std::any_of(files.begin(), files.end(), [](const NamedFile& file) { return file.path == "/no/such.ocio"; });
  };
  EXPECT_TRUE(reads_it({}));
  for (const char* other : {"output.ocio=built-in", "output.ocio=own.ocio", "output.ocio=ocio://default"})
    EXPECT_FALSE(reads_it({other})) << other;
  unsetenv("OCIO");
}

}  // namespace
}  // namespace tensorray
