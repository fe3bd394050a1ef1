#include "integrators/methods/read_scene.h"

#include <map>

#include <sys/stat.h>

#include "base/files/temporary_folder.h"
#include "integrators/lens/lens_method.h"
#include "integrators/path_tracing/path_tracing_method.h"
#include "integrators/photon_distribution/photon_distribution_method.h"
#include "scenes/description/check_scene.h"
#include "tests/files.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;
using Overrides = std::vector<std::string>;
using Files = std::map<std::string, fs::path>;

const char* const smallest = R"({"field": {"file": "a.vdb"}, "integrator": {"type": "photon_distribution"}})";

/// Makes a folder for each test, and removes it after the test.
class ReadScene : public testing::Test {
 protected:
  fs::path file(const std::string& text) const {
    write_bytes(folder_ / "scene.json", text);
    return folder_ / "scene.json";
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
  const fs::path folder_ = temporary_ / "";
};

TEST_F(ReadScene, ReadsEveryKindOfValue) {
  const SceneDescription scene = read({}, R"({
    // A comment, and another one:  /* */
    "$schema": "scene.schema.json",
    "seed": 7,
    "field": { "file": "/data/stress.vdb", "name": "stress", "derive": "gradient", "eigenvalues": "positive",
               "scale": -2.5, "bounds": "hull.ply" },
    "bending": { "rgb": [0.1, 0.2, 0.3], "method": "dopri5", "step": 0.25, "tolerance": 1e-5, "max_steps": 1e3 },
    "light": { "direction": [1, 0, -1], "up": [0, 1, 0], "photons": 1e6, "pattern": "sobol", "spectrum": "lamp.txt",
               "irradiance": 2, "aperture": { "center": [1, 2, 3], "size": [4, 5] } },
    "obstacles": [ { "file": "body.ply" }, { "file": "../hand.obj" } ],
    "receiver": { "center": [0, 0, -3], "normal": [0, 0, 1], "up": [1, 0, 0], "size": [2, 3], "resolution": [64, 32] },
    "integrator": { "type": "photon_distribution", "density": { "kind": "histogram", "tau": 2 } },
    "output": { "photons": "out/photons.vtp", "exposure": -1, "white_balance": false, "view": "Raw" }
  })");
  EXPECT_EQ(scene.seed, 7u);
  EXPECT_EQ(scene.field.file, "/data/stress.vdb");
  EXPECT_EQ(scene.field.name, "stress");
  EXPECT_EQ(scene.field.derive, Derive::gradient);
  EXPECT_EQ(scene.field.scale, -2.5);
  EXPECT_EQ(scene.bending.rgb, Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(scene.bending.settings.method, BendingMethod::dopri5);
  EXPECT_EQ(scene.bending.settings.max_steps, 1000);
  EXPECT_EQ(scene.light.direction, Vector3d(1, 0, -1));
  EXPECT_EQ(scene.light.photons, 1000000u);
  EXPECT_EQ(scene.light.pattern, BeamPattern::sobol);
  EXPECT_EQ(std::get<fs::path>(scene.light.spectrum), folder_ / "lamp.txt");
  ASSERT_TRUE(scene.light.aperture);
  EXPECT_EQ(scene.light.aperture->size, Vector2d(4, 5));
  EXPECT_EQ(scene.obstacles, (std::vector<fs::path>{folder_ / "body.ply", folder_ / "../hand.obj"}));
  EXPECT_EQ(scene.receiver.size, Vector2d(2, 3));
  EXPECT_EQ(scene.receiver.resolution, Vector2i(64, 32));
  const PhotonDensity& density = scene.integrator.settings<PhotonDescription>().density;
  EXPECT_EQ(density.kind, PhotonDensityKind::histogram);
  EXPECT_EQ(density.tau, 2);
  EXPECT_EQ(scene.output.files, (Files{{"photons", folder_ / "out/photons.vtp"}}))
      << "one output is named, so that the others are not wanted";
  EXPECT_EQ(scene.output.exposure, -1);
  EXPECT_FALSE(scene.output.white_balance);
}

TEST_F(ReadScene, WordsStandForNoValue) {
  const SceneDescription scene = read({"field.scale=auto", "bending.step=auto", "output.exposure=auto",
                                       "light.wavelengths.per_photon=all", "receiver.resolution=100"});
  EXPECT_FALSE(scene.field.scale);
  EXPECT_EQ(scene.bending.settings.step, 0);
  EXPECT_FALSE(scene.output.exposure);
  EXPECT_EQ(scene.light.wavelengths_per_photon, 0);
  EXPECT_EQ(scene.receiver.resolution, Vector2i(100, 100));
}

TEST_F(ReadScene, Generates) {
  const std::string text = R"({"field": {"generate": {"kind": "constant", "tensor": [[1, 2, 3], [4, 5, 6], [7, 8, 9]],
      "resolution": [4, 5, 6], "min": [0, 0, 0], "max": [1, 2, 3]}}, "integrator": {"type": "photon_distribution"}})";
  const SceneDescription scene = read({}, text);
  ASSERT_TRUE(scene.field.generate);
  const auto& constant = std::get<Constant>(scene.field.generate->generator);
  EXPECT_EQ(constant.tensor(0, 1), 2);
  EXPECT_EQ(constant.tensor(2, 0), 7);
  EXPECT_EQ(scene.field.generate->grid.resolution, Vector3i(4, 5, 6));
  EXPECT_EQ(scene.field.generate->grid.max, Vector3d(1, 2, 3));
  // One resolution makes cubes.
  const auto grid_of = [this](const std::string& generate) {
    return read({"field.file=null", "field.generate={" + generate + "}"}).field.generate->grid;
  };
  const GridSettings standard = grid_of(R"("kind":"helix","resolution":17)"), expected = default_grid(Helix{}, 17);
  EXPECT_EQ(standard.resolution, expected.resolution);
  EXPECT_EQ(standard.max, expected.max);
  EXPECT_EQ(grid_of(R"("kind":"helix","resolution":17,"min":[0,0,0],"max":[1,2,4])").resolution, Vector3i(5, 9, 17));
}

TEST_F(ReadScene, OverridesChangeAddAndRemove) {
  const Overrides overrides{"light.photons=12",           "light.pattern=grid", "obstacles.0.file=a.ply",
                            "obstacles.1.file=\"b.ply\"", "obstacles.0=null",   "receiver.size.0=3",
                            "receiver.size.1=4",          "output.view=x=y",    "light.photons=13",
                            "nothing.here=null"};
  const SceneDescription scene = read(overrides);
  EXPECT_EQ(scene.light.photons, 13u);
  EXPECT_EQ(scene.light.pattern, BeamPattern::grid);
  EXPECT_EQ(scene.obstacles, std::vector<fs::path>{folder_ / "b.ply"});
  EXPECT_EQ(scene.receiver.size, Vector2d(3, 4));
  EXPECT_EQ(scene.output.view, "x=y");
  const auto text = nlohmann::json::parse(scene.text);
  EXPECT_EQ(text["light"]["photons"], 13) << "the scene's text is that after overrides";
}

TEST_F(ReadScene, OverridesAreChecked) {
  refuses("must be KEY=VALUE", {"seed"});
  refuses("must be KEY=VALUE", {"=3"});
  refuses("one dot", {"light..photons=3"});
  refuses("`x` has no place in \"a.vdb\"", {"field.file.x=3"});
  refuses("no item 7", {"obstacles.0.file=a", "obstacles.7.file=a"});
  refuses("must be a number", {"obstacles.0.file=a", "obstacles.x.file=a"});
  refuses("nested deeper", {"seed=" + std::string(100000, '[')});
  std::string deep = "a";
  for (int i = 0; i < 100000; ++i) deep += ".a";
  refuses("deeper", {deep + "=1"});
}

TEST_F(ReadScene, UnknownKeysAreRefusedWithTheNearest) {
  const std::string file = (folder_ / "scene.json").string();
  EXPECT_EQ(error({"lihgt.photons=1"}), file + ": unknown key `/lihgt`; did you mean `light`?");
  refuses("`/light/photon`; did you mean `photons`?", {"light.photon=1"});
  refuses("`/light/wavelengths/cuont`; did you mean `count`?", {"light.wavelengths.cuont=1"});
  refuses("`/obstacles/0/fiel`; did you mean `file`?", {"obstacles.0.fiel=a"});
  refuses("unknown key `/weather`; known keys are `$schema`, `bending`, `camera`", {"weather={}"});
  refuses("`/a~1b~0c`", {"a/b~c=1"});
  refuses("known keys", {std::string(5000, 'x') + "=1"});
  // Of other programs.
  refuses("`/camera/fov`; here it is camera.angle", {"camera.fov=30"});
  refuses("`/integrator/spp`; here it is integrator.max_samples", {"integrator.spp=64"});
  EXPECT_THAT(error({"light.intensity=3"}), AllOf(HasSubstr("`; here it is "), HasSubstr("light.irradiance")));
  refuses("location`; did you mean `position`", {R"(lights=[{"location":[0,0,1]}])"});
  refuses("/path`; did you mean `paths`", {R"(objects=[{"path":"a.obj"}])"});
  refuses("/seeds/origin`; known keys are", {"integrator.seeds.origin=[0,0,1]"});
  refuses("unknown key `/field/generate/lod`", {"field.file=null", "field.generate={\"kind\":\"helix\",\"lod\":1}"});
}

TEST_F(ReadScene, WrongTypesSayWhatIsExpectedAndFound) {
  const std::string file = (folder_ / "scene.json").string();
  EXPECT_EQ(error({"output.white_balance=1"}), file + ": `/output/white_balance` must be true or false, but is 1");
  EXPECT_THAT(error({"light.photons=many"}),
              AllOf(HasSubstr("`/light/photons` must be an integer"), EndsWith("but is \"many\"")));
  refuses(R"(must be one of "auto", "euler", "splitting", "splitting4", "rk4", "bs23", "dopri5", but is "rk5")",
          {"bending.method=rk5"});
  EXPECT_THAT(error({"integrator.type=lenses"}),
              AllOf(HasSubstr("must be one of \"photon_distribution\", \"lens\", "), EndsWith("but is \"lenses\"")));
  refuses("`/light` must be an object", {"light=[]"});
  refuses("`/obstacles` must be a list of objects", {"obstacles={}"});
  refuses("`/obstacles/0` must be an object", {"obstacles=[1]"});
  refuses("`/field/file` must be a file name, but is \"\"", {"field.file="});
  refuses("must be a number other than 0, or \"auto\", but is \"x\"", {"field.scale=x"});
  refuses("a list of 3 numbers", {"light.direction=[0,1]"});
  refuses("a list of 3 numbers", {"light.direction=[0,1,null]"});
}

TEST_F(ReadScene, WrongLensesAreRefused) {
  refuses("\"checkerboard\", \"grid\", \"color_wheel\"", {"integrator.image=chekerboard"});
  refuses("a number, or a list of them", {"integrator.image_plane.depth=[]"});
  refuses("a number, or a list of them", {"integrator.image_plane.depth=[0,\"a\"]"});
  refuses("/integrator/image_plane", {"integrator.image_plane.depth=0", "integrator.image_plane.distance=1"});
  refuses("is perpendicular to the light", {"integrator.image_plane.normal=[1,0,0]"});
  refuses("an integer from 1 to 16", {"integrator.samples=0"});
}

/// What no bound of the schema refuses; schema_test.cpp has the others.
TEST_F(ReadScene, ValuesOutOfRange) {
  const Overrides wrong{"light.photons=1e30",           "seed=18446744073709551616",
                        "light.direction=[0,0,0]",      "light.direction=[1e-200,0,0]",
                        "light.direction=[1e200,0,0]",  "light.irradiance=NaN",
                        "light.irradiance=1e999",       "light.aperture.size=[1,0]",
                        "bending.max_steps=4294967297", "receiver.normal=[0,0,0]",
                        "receiver.size=[1,-1]",         "receiver.resolution=[1,0]",
                        "output.image=picture.bmp",     "output.image=png",
                        "output.exr=picture.png",       "output.spectral=spectra.csv",
                        "output.photons=photons.ply",   "output.fluence=light.exr"};
  for (const std::string& change : wrong) {
    std::string pointer = "/" + change.substr(0, change.find('='));
    for (char& c : pointer) c = c == '.' ? '/' : c;
    refuses("`" + pointer + "` must be ", {change});
  }
}

TEST_F(ReadScene, GeneratorsAreChecked) {
  const std::string start = R"({"integrator": {"type": "photon_distribution"}, "field": {"generate": )";
  refuses("`/field/generate` needs the key `kind`", {}, start + "{}}}");
  refuses("`helix`, but is \"hleix\"", {}, start + R"({"kind": "hleix"}}})");
  refuses("`/field/generate/kind` must be one of", {}, start + R"({"kind": 3}}})");
  refuses("poisson_ratio", {}, start + R"({"kind": "point_load", "poisson_ratio": 0.7}}})");
  refuses("axis", {}, start + R"({"kind": "rotation", "axis": [0, 0, 0]}}})");
  refuses("`max`", {}, start + R"({"kind": "helix", "min": [2, 0, 0]}}})");
  refuses("`/field/generate/resolution`", {}, start + R"({"kind": "helix", "resolution": 0}}})");
  refuses("2^31", {}, start + R"({"kind": "helix", "resolution": 20000}}})");
  refuses("3 rows of 3 numbers", {}, start + R"({"kind": "constant", "tensor": [1,0,0,0,1,0,0,0,1]}}})");
}

TEST_F(ReadScene, KeysThatAreMissingOrExcludeEachOther) {
  EXPECT_THAT(error({"field=null"}), EndsWith("the scene needs the key `field`"));
  EXPECT_THAT(error({"integrator=null"}), EndsWith("the scene needs the key `integrator`"));
  EXPECT_THAT(error({"integrator.type=null"}), EndsWith("`/integrator` needs the key `type`"));
  EXPECT_THAT(error({"field.file=null"}), EndsWith("`/field` needs exactly one of `file` and `generate`"));
  EXPECT_THAT(error({"field.generate.kind=helix"}), EndsWith("`/field` needs exactly one of `file` and `generate`"));
  refuses("`/output/spectral` needs", {"bending.rgb=[1,2,3]", "output.spectral=a.exr"});
  refuses("exclude each other", {"receiver.center=[0,0,0]", "receiver.distance=1"});
}

TEST_F(ReadScene, ChecksAcrossKeys) {
  refuses("`/light/wavelengths/min` (600 nm)", {R"(light.wavelengths={"min":600,"max":500})"});
  refuses("`/light/wavelengths/count` must be 1", {R"(light.wavelengths={"min":600,"max":600})"});
  EXPECT_EQ(read({R"(light.wavelengths={"min":600,"max":600,"count":1})"}).light.wavelength_count, 1);
  refuses("must divide `count` (32), but is 5", {"light.wavelengths.per_photon=5"});
  refuses("must divide", {"light.wavelengths.per_photon=64"});
  EXPECT_EQ(read({"light.wavelengths.per_photon=8"}).light.wavelengths_per_photon, 8);
  refuses("`/receiver/normal` is perpendicular to the light", {"receiver.normal=[1,0,0]"});
  EXPECT_NO_THROW(read({"receiver.normal=[1,0,0.01]"}));
  EXPECT_NO_THROW(read({"light.up=[0,0,1]"})) << "up along the light has a fallback";
}

TEST_F(ReadScene, Spectra) {
  for (const std::string name : {"D65", "E", "A"})
    EXPECT_EQ(std::get<Illuminant>(read({"light.spectrum=" + name}).light.spectrum).name, name);
  EXPECT_EQ(std::get<BlackBody>(read({"light.spectrum=blackbody 5500"}).light.spectrum).kelvin, 5500);
  EXPECT_EQ(std::get<BlackBody>(read({"light.spectrum=blackbody  2856.5 "}).light.spectrum).kelvin, 2856.5);
  const auto file_of = [this](const std::string& text) {
    return std::get<fs::path>(read({"light.spectrum=" + text}).light.spectrum);
  };
  EXPECT_EQ(file_of("blackbody.txt"), folder_ / "blackbody.txt");
  EXPECT_EQ(file_of("/lamps/led"), "/lamps/led");
  refuses("`/light/spectrum` must be one of \"D65\"", {"light.spectrum=d65"});
  for (const std::string wrong : {"", " -1", " 0", " hot", " 5000 K", " 0x1p12", " nan", " inf", " 1e300"}) {
    SCOPED_TRACE(wrong);
    refuses("blackbody KELVIN", {"light.spectrum=blackbody" + wrong});
  }
}

TEST_F(ReadScene, KeysOfAnotherKindAreRefused) {
  const auto expect = [this](const Overrides& overrides, const std::string& pointer) {
    refuses("`" + pointer + "` has a meaning only where", overrides);
  };
  expect({R"(integrator.material={"kind":"metal","clearcoat":1})"}, "/integrator/material/clearcoat");
  expect({R"(integrator.material={"metal":"gold"})"}, "/integrator/material/metal");
  expect({R"(integrator.material={"kind":"diffuse","roughness":1})"}, "/integrator/material/roughness");
  expect({R"(integrator.seeds={"kind":"grid","radius":1})"}, "/integrator/seeds/radius");
  expect({R"(integrator.seeds={"kind":"sphere","file":"a.txt"})"}, "/integrator/seeds/file");
  expect({R"(lights=[{"kind":"constant"},{"kind":"constant","angle":3}])"}, "/lights/1/angle");
  EXPECT_NO_THROW(read({R"(integrator.material={"kind":"glass","index":1.3,"roughness":0})"}));
  EXPECT_NO_THROW(read({R"(integrator.material={"clearcoat":1})"})) << "principled is the default";
}

TEST_F(ReadScene, Warnings) {
  const auto warnings = read({"light.wavelengths.max=800"}).warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("-0.05 at 800 nm"));  // 0.75 − 0.001 · 800
  EXPECT_TRUE(read({"light.wavelengths.max=750"}).warnings.empty());
  EXPECT_THAT(read({"bending.rgb=[1,2,3]", "bending.b=0"}).warnings.at(0), HasSubstr("`/bending/b` has no effect"));
  EXPECT_THAT(read({"bending.rgb=[1,2,3]", "light.wavelengths.count=4"}).warnings.at(0), HasSubstr("no effect"));
}

TEST_F(ReadScene, SyntaxErrorsHaveAPosition) {
  const std::string file = (folder_ / "scene.json").string();
  refuses(file + ": line 3, column 11: ", {}, "{\n  \"seed\": 1,\n  \"field\" {}\n}");
  EXPECT_THAT(error({}, "{\n  \"seed\": 1,\n}"),
              AllOf(HasSubstr("line 3, column 1: "), HasSubstr("extra comma before it")));
  refuses("line 1, column 11: ", {}, "{\"seed\": 1");
  refuses("line 1, column 13: ", {}, "{\"seed\": 1} x");
  refuses("number overflow", {}, "{\"seed\": 1e999}");
  refuses("key `seed` is given twice", {}, "{\"seed\": 1, \"seed\": 2}");
}

// The files that scenes name, read and write.
/// A path is any bytes. The scene's text, which is kept in files and read again, has them as UTF-8.
TEST_F(ReadScene, PathsOfAnyBytesComeBack) {
  const std::string name = "u\xff\xc3(.vdb";
  const SceneDescription scene = read({"field.file=" + name, "output.ocio=/tmp/" + name});
  for (const SceneDescription& each : {scene, read_scene_json(parse_value(scene.text), scene.path)}) {
    EXPECT_EQ(each.field.file, folder_ / name);
    EXPECT_EQ(each.output.ocio, "/tmp/" + name);
  }
  EXPECT_EQ(read_scene("/tmp/" + name, {}).field.file, "/tmp/" + name);
}

TEST_F(ReadScene, OutputsNeverOverwriteEachOtherOrAnInput) {
  refuses("same file as `/output/exr`", {"output.exr=a.exr", "output.spectral=./x/../a.exr"});
  refuses("`/output/photons` (" + (folder_ / "a.vdb").string() + ") is the same file as `/field/file`",
          {"output.photons=a.vdb"});
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
  EXPECT_THAT(message([&] { files_of({"a.png", "b.jpg"}); }), HasSubstr("one kind"));
  EXPECT_THAT(message([&] { files_of({"a.gif"}); }), HasSubstr(".png, .jpg"));
  EXPECT_THAT(message([&] { files_of({"a.vdb"}, {"integrator.type=lens"}); }), HasSubstr("lens makes no photons"));
}

/// input_files lists every key that names a file, and an output is refused under any name of the same file.
TEST_F(ReadScene, NoOutputTakesThePlaceOfAnInput) {
  for (const char* name :
       {"body.ply", "cut.ply", "photo.png", "sky.exr", "lamp.txt", "config.ocio", "seeds.txt", "optic.txt"})
    write_bytes(folder_ / name, name);
  fs::create_directories(folder_ / "folder");
  unsetenv("OCIO");
  const SceneDescription scene = read({}, R"({
    "field": {"file": "a.vdb", "bounds": "cut.ply"}, "obstacles": [{"file": "body.ply"}],
    "light": {"spectrum": "lamp.txt"}, "lights": [{"kind": "environment", "file": "sky.exr"}],
    "integrator": {"type": "photon_distribution", "image": "photo.png", "stress_optic": "optic.txt",
                   "seeds": {"kind": "file", "file": "seeds.txt"}},
    "output": {"ocio": "config.ocio"}})");
  for (const NamedFile& input : input_files(scene)) {
    if (!fs::exists(input.path)) continue;
    const fs::path hard = folder_ / "hard_link", soft = folder_ / "soft_link";
    fs::remove(hard);
    fs::remove(soft);
    fs::create_hard_link(input.path, hard);
    fs::create_symlink(input.path.filename(), soft);
    for (const fs::path& output : {input.path, folder_ / "folder/.." / input.path.filename(), hard, soft})
      EXPECT_THROW(check_files(scene, {{output, "--stats"}}), SceneError) << input.name << " by " << output;
    // To open a pipe may take for ever. Only the scene itself may come through one.
    const fs::path aside = folder_ / "aside";
    fs::rename(input.path, aside);
    ASSERT_EQ(mkfifo(input.path.c_str(), 0600), 0);
    EXPECT_THAT(message([&] { check_files(scene, {}); }),
                HasSubstr(input.path == scene.path ? "nothing was thrown" : "is a pipe or a device"))
        << input.name;
    fs::remove(input.path);
    fs::rename(aside, input.path);
  }
  EXPECT_EQ(input_files(scene).size(), 11u) << "a new kind of input belongs into this test";
  EXPECT_NO_THROW(check_files(scene, {{folder_ / "new.json", "--stats"}}));
  EXPECT_NO_THROW(check_files(scene, {{"/dev/stdout", "--stats"}}));
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
