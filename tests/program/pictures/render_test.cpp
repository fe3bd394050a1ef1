// `tensorray render`: its files, and fields without a scene file.

#include "tests/program/support.h"

namespace tensorray {
namespace {

TEST_F(Program, WritesPictureAndExrBesideTheScene) {
  write("scene.json", small_scene());
  const Outcome outcome = run_well({"render", "scene.json", "--seed", "77"});
  EXPECT_THAT(files(), ElementsAre("scene.exr", "scene.json", "scene.png"));
  EXPECT_THAT(outcome.out, HasSubstr("scene.png"));
  EXPECT_THAT(outcome.error, HasSubstr("scale"));  // The program reports what "auto" chose.
  const Image exr = read_image(in_folder("scene.exr"));
  EXPECT_EQ(exr.width, 32);
  EXPECT_THAT(exr.channels, ElementsAre("R", "G", "B"));
  const std::string bytes = contents("scene.exr");
  for (const char* provenance : {"tensorray:version", "tensorray:scene", "point_load", "tensorray:seed", "77",
                                 "tensorray:photons", "tensorray:ocio_config", "tensorray:color_space"})
    EXPECT_NE(bytes.find(provenance), std::string::npos) << provenance;
  EXPECT_THAT(run_well({"render", "scene.json", "--set", "bending.a=0.5"}).error, HasSubstr("warning: "));
  const Outcome quiet = run_well({"render", "scene.json", "--quiet"});
  EXPECT_EQ(quiet.out + quiet.error, "");
}

/// Of all options, these change the bytes in no way, or in all that is drawn at random.
TEST_F(Program, ThreadsDoNotChangeTheFilesAndTheSeedDoes) {
  write("scene.json", small_scene());
  for (const std::string change : {"light.pattern=stratified", "light.pattern=sobol", "light.pattern=random",
                                   "light.pattern=grid", R"(integrator={"type":"lens","mode":"scatter"})"}) {
    const auto bytes = [&](const char* threads, const char* seed) {
      Arguments endings{"exr", "png", "spectral.exr"},
          arguments{"render", "scene.json", "-q", "--threads", threads, "--seed", seed};
      if (change[0] == 'l') endings.insert(endings.end(), {"vtp", "fluence.vdb"});
      for (const std::string& ending : endings) arguments.insert(arguments.end(), {"-o", "out." + ending});
      run_well(joined(arguments, changes({change, "light.wavelengths.per_photon=1"})));
      std::string all;
      for (const std::string& ending : endings) all += contents("out." + ending);
      return all;
    };
    const std::string one = bytes("1", "5");
    EXPECT_TRUE(bytes("7", "5") == one) << change;
    EXPECT_TRUE(bytes("7", "6") != one || change == "light.pattern=grid" || change[0] == 'i') << change;
  }
}

TEST_F(Program, FilesGoThroughMakeInfoAndRender) {
  run_well({"make", "vortex", "-o", "vortex.vdb", "--resolution", "16", "--circulation", "3"});
  EXPECT_THAT(json::parse(run_well({"info", "vortex.vdb", "--json"}).out).dump(), HasSubstr("circulation=3"));
  EXPECT_THAT(run_well({"info", "vortex.vdb"}).out, HasSubstr("4096"));
  // The same field gives the same picture if it is made in memory.
  const auto rendered = [&](const std::string& field) {
    write("scene.json", small_scene(field));
    run_well({"render", "scene.json", "-q"});
    return pixels("scene.exr");
  };
  EXPECT_EQ(rendered(R"({"file": "vortex.vdb"})"),
            rendered(R"({"generate": {"kind": "vortex", "resolution": 16, "circulation": 3}})"));
}

TEST_F(Program, AnInterruptLeavesNothingBehind) {
  write("scene.json", small_scene());
  write("scene.png", "an old picture");
  const pid_t child = start({"render", "scene.json", "--set", "light.photons=1e9"});
  // Rendering has begun when the temporary files exist.
  while (files().size() < 4 && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  kill(child, SIGINT);
  EXPECT_EQ(wait_for(child).status, 130);
  EXPECT_THAT(files(), ElementsAre("scene.json", "scene.png"));
  EXPECT_EQ(contents("scene.png"), "an old picture");
}

TEST_F(Program, HelpAndVersion) {
  EXPECT_THAT(run_well({"--help"}).out, HasSubstr("render"));
  EXPECT_THAT(run_well({"render", "--help"}).out, HasSubstr("--set"));
  EXPECT_THAT(run_well({"make", "vortex", "--help"}).out, HasSubstr("--circulation"));
  EXPECT_THAT(run_well({"--version"}).out, StartsWith("tensorray "));
  EXPECT_TRUE(json::parse(run_well({"schema"}).out).contains("$schema"));
}

// `tensorray render` of a field without a scene file, and the scene that it saves.

class FieldAlone : public Program {
 protected:
  void SetUp() override { run_well({"make", "point_load", "-o", "stress.vdb", "--resolution", "17"}); }

  static Arguments with_small(const Arguments& arguments) {
    return joined(arguments, changes({"receiver.resolution=[24,24]", "light.wavelengths.count=4"}));
  }
};

TEST_F(FieldAlone, IsRenderedWithDefaultsAndTheSceneIsToldAndSaved) {
  std::filesystem::create_directory(in_folder("else where"));
  const Outcome outcome = run_well(with_small(
      {"render", "stress.vdb", "-o", "alone.png", "-o", "alone.exr", "--save-scene", "else where/stress.json"}));
  EXPECT_THAT(outcome.error, HasSubstr(R"(scene: {"field":)"));
  const json scene = read_json("else where/stress.json");
  EXPECT_EQ(scene["integrator"]["type"], "photon_distribution");
  EXPECT_EQ(scene["receiver"]["resolution"], json::array({24, 24}));
  EXPECT_GT(contents("alone.png").size(), 1000u);
  // The pictures differ only in the name of the scene in their headers.
  run_well({"render", "else where/stress.json", "-o", "again.exr", "-q"});
  EXPECT_EQ(pixels("alone.exr"), pixels("again.exr"));
}

TEST_F(FieldAlone, NothingIsOverwrittenOrMadeWrong) {
  const std::string field = contents("stress.vdb");
  expect_error("--save-scene", {"render", "stress.vdb", "-q", "--save-scene", "stress.vdb"});
  expect_error("--save-scene", {"render", "stress.vdb", "-q", "-o", "a.png", "--save-scene", "a.png"});
  EXPECT_EQ(contents("stress.vdb"), field);
  expect_error("nothing.vdb", {"render", "nothing.vdb", "-q"});
  write("broken.vdb", "no field");
  expect_error("broken.vdb", {"render", "broken.vdb", "-q"});
  std::filesystem::create_directory(in_folder("scenes"));
  write("scene.json", R"({ "field": { "file": "stress.vdb" }, "integrator": { "type": "photon_distribution" } })");
  expect_error("must be in the folder of", {"render", "scene.json", "-q", "--save-scene", "scenes/scene.json"});
  run_well(with_small({"render", "scene.json", "-q", "-o", "b.png", "--save-scene", "small.json"}));
  EXPECT_EQ(read_json("small.json")["field"]["file"], "stress.vdb");
}

TEST_F(FieldAlone, FilesThatHaveToBeImportedAreRenderedAsTheyAreAfterAnImport) {
  std::string numbers;
  for (int i = 0; i < 5 * 5 * 5; ++i) numbers += fmt::format("{} 0 {} 2 0 3\n", i % 5, 0.3 * (i / 5 % 5));
  write("tensors.nrrd", nrrd("5 5 5", numbers));
  const Outcome outcome = run_well(with_small({"render", "tensors.nrrd", "--stats", "stats.json"}));
  run_well({"import", "tensors.nrrd", "-o", "tensors.vdb", "-q"});
  run_well(with_small({"render", "tensors.vdb", "-o", "after.exr", "-q"}));
  EXPECT_EQ(pixels("tensors.exr"), pixels("after.exr"));
  EXPECT_TRUE(has("tensors.png"));
  EXPECT_THAT(outcome.error, AllOf(HasSubstr("light: along ["), HasSubstr("tensors.nrrd, 125 voxels"),
                                   Not(HasSubstr("field.vdb")), HasSubstr("eigenvalues absolute")));
  std::filesystem::copy_file(in_folder("tensors.nrrd"), in_folder("run.1.nrrd"));
  const Outcome negated = run_well(with_small({"render", "run.1.nrrd", "--negate"}));
  EXPECT_THAT(negated.error, HasSubstr("eigenvalues raw"));
  EXPECT_TRUE(has("run.1.png"));

  write("mask.nii", "a mask");
  write("case.foam", "");
  const std::pair<const char*, Arguments> wrong[] = {
      // Before the import.
      {"--mask", {"render", "tensors.nrrd", "--mask", "mask.nii", "-o", "mask.nii"}},
      {"--mask", {"derive", "tensors.nrrd", "--mask", "mask.nii", "--invariant", "trace", "-o", "mask.nii"}},
      {"the input", {"derive", "tensors.nrrd", "mask.nii", "--invariant", "trace", "-o", "mask.nii"}},
      {"the input", {"render", "tensors.nrrd", "mask.nii", "-o", "mask.nii"}},
      {"the input", {"render", "tensors.nrrd", "m.noise.nii", "-o", "m.nii", "--split"}},
      {"no invariant", {"derive", "noise.vti", "--invariant", "bogus", "-o", "a.vdb"}},
      {"belong together", {"explore", "noise.vti", "--pick", "3", "-o", "a.png"}},
      {"tensors.nrrd mask.nii -o", {"render", "tensors.nrrd", "mask.nii", "--save-scene", "a.json"}},
      // Other mistakes.
      {"case.foam", {"render", "case.foam", "--gradient-of", "U"}},
      {"tensors.nrrd: has no tensor field",
       {"derive", "tensors.nrrd", "--name", "bogus", "--invariant", "trace", "-o", "a.vdb"}},
      {"three edges", {"render", "tensors.nrrd", "--voxel-size", "1", "1", "2"}},
      {"tensorray import", {"render", "tensors.nrrd", "--save-scene", "scene.json"}},
      {"--stats", {"render", "tensors.nrrd", "--stats", "tensors.nrrd"}},
      {"tensors.nrrd", {"render", "tensors.nrrd", "--array", "stress"}},
      {"have to be imported", {"render", "stress.vdb", "--order", "vtk"}},
      {"`tensorray import tensors.nrrd --array 'stress' -o FIELD.vdb`",
       {"render", "tensors.nrrd", "--array", "stress", "--save-scene", "scene.json"}},
      {"missing.nii.gz does not exist", {"render", "missing.nii.gz", "--order", "fsl"}},
      {"noise.vti", {"render", "noise.vti"}}};
  write("noise.vti", "noise");
  write("m.noise.nii", "another");
  for (const auto& [text, arguments] : wrong) expect_error(text, arguments);
  EXPECT_EQ(contents("mask.nii"), "a mask");
}

TEST_F(FieldAlone, IsSplitFromItsNoiseInTheSameLight) {
  const Outcome outcome =
      run_well(with_small({"render", "stress.vdb", "--split", "-o", "s.exr", "-o", "s.spectral.exr"}));
  for (const char* file : {"s.exr", "s.spectral.exr", "s.noise.exr", "s.noise.spectral.exr"})
    EXPECT_TRUE(has(file)) << file;
  const std::string of_noise = outcome.error.substr(outcome.error.find("its noise alone"));
  for (const char* judged : {"too coarse", "too little", "field.scale"}) EXPECT_THAT(of_noise, Not(HasSubstr(judged)));
}

TEST_F(FieldAlone, OfAPolariscopeTheCoefficientIsSaved) {
  run_well(
      with_small({"render", "stress.vdb", "-q", "--method", "polariscope", "-o", "p.png", "--save-scene", "p.json"}));
  const json scene = read_json("p.json");
  EXPECT_TRUE(scene["integrator"]["stress_optic"].is_number()) << scene.dump();
  EXPECT_FALSE(scene["field"].contains("scale")) << scene.dump();
}

}  // namespace
}  // namespace tensorray
