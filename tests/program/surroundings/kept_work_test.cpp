// Renders that are killed, interrupted, continued and divided: the files are always those of one render.

#include "scenes/jobs/work_file.h"
#include "tests/program/divided_scenes.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

class KeptWork : public Program {
 protected:
  void SetUp() override {
    run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "17"});
    make(scene());
  }

  virtual std::string scene() const { return path_scene; }

  /// Makes the scene and the files of one render.
  void make(const std::string& scene) const {
    write("scene.json", scene);
    run_well(render("whole"));
  }

  static Arguments render(const std::string& name, const Arguments& more = {}) {
    return joined({"render", "scene.json", "-q", "-o", name + ".png", "-o", name + ".exr"}, more);
  }

  /// What a render of a.png and a.exr says.
  std::string said(Arguments arguments) const {
    arguments.erase(std::find(arguments.begin(), arguments.end(), "-q"));
    return run_well(arguments).error;
  }

  /// The number of a file on its disk; 0 if there is none. A file that is replaced has another one.
  ino_t number_of(const std::string& file) const {
    struct stat status {};
    return stat(in_folder(file).c_str(), &status) == 0 ? status.st_ino : 0;
  }

  /// Starts a render and waits until it has written a file, or has ended. @return the process.
  pid_t start_until(const std::string& file, const Arguments& arguments) const {
    const ino_t before = number_of(file);
    const pid_t child = start(arguments);
    while (number_of(file) == before && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return child;
  }

  /// A run that a signal ends as soon as it has written a file. A run that was quicker than the signal (it ended, or
  /// had written its whole picture already) is tried again, as often as it takes: what is tested does not depend on the
  /// machine's speed.
  Outcome end_by(int signal, const std::string& file, const Arguments& arguments) const {
    while (true) {
      const pid_t child = start_until(file, arguments);
      kill(child, signal);
      Outcome outcome = wait_for(child);
      const bool is_whole = is_equal("a.png", "whole.png") || is_equal("a.exr", "whole.exr");
      if (outcome.status != 0 && number_of(file) != 0 && !is_whole) return outcome;
      for (const char* made : {"a.png", "a.exr", "2.shard"}) std::filesystem::remove(in_folder(made));
    }
  }

  /// The same for a render of the pictures a.*, of which none is there before it.
  Outcome end_by(int signal, const Arguments& more = {}) const {
    for (const char* picture : {"a.png", "a.exr"}) std::filesystem::remove(in_folder(picture));
    return end_by(signal, "a.png.checkpoint", joined(render("a", more), {"--checkpoint", "0.01"}));
  }

  void expect_same(const std::string& name) const {
    for (const char* ending : {".png", ".exr"})
      EXPECT_TRUE(is_equal(name + ending, "whole" + std::string(ending))) << ending;
  }

  /// The checkpoint with results of another size, whose hash is right.
  std::string forged() const {
    WorkFile work = read_work(in_folder("a.png.checkpoint"));
    for (auto& [name, result] : work.results) result = std::make_shared<const std::string>("of another size");
    write_work(in_folder("forged"), work);
    return contents("forged");
  }

  void make_shards(int count) const {
    for (int i = 1; i <= count; ++i) run_well(render_shard(i, count));
  }

  static Arguments render_shard(int i, int count, const Arguments& more = {}) {
    return joined({"render", "scene.json", "-q", "--shard", fmt::format("{}/{}", i, count), "-o", shard(i)}, more);
  }

  static std::string shard(int i) { return fmt::format("{}.shard", i); }

  static Arguments merge(const Arguments& shards) {
    return joined({"merge", "-q", "-o", "a.png", "-o", "a.exr"}, shards);
  }
};

/// Each method: tiles and the light before them, sums of photons, flow maps, rows; parts of a plate that are refined.
class DividedWork : public KeptWork, public testing::WithParamInterface<std::string> {
  std::string scene() const override { return GetParam(); }
};

TEST_P(DividedWork, ThatIsKilledContinuesToTheSameFiles) {
  for (int i = 0; i < 2; ++i) EXPECT_EQ(end_by(SIGKILL, {"--threads", "1"}).status, 128 + SIGKILL);
  run_well(render("a", {"--resume"}));
  expect_same("a");
  EXPECT_FALSE(has("a.png.checkpoint"));
}

TEST_P(DividedWork, IsTheSameOnAnyNumberOfThreads) {
  for (const char* threads : {"1", "7"}) {
    run_well(render("a", {"--threads", threads}));
    expect_same("a");
  }
}

TEST_P(DividedWork, OfShardsMergesToTheSameFiles) {
  make_shards(3);
  run_well(merge({"3.shard", "1.shard", "2.shard"}));
  expect_same("a");
}

INSTANTIATE_TEST_SUITE_P(Methods, DividedWork,
                         testing::Values(lit_scene, plate_under_paths("mesh"), plate_scene(gaussian_photons, 100000),
                                         plate_scene(R"({"type": "photon_distribution", "density": {"error": 0.5}})"),
                                         plate_scene(lens), plate_scene(stretch),
                                         plate_scene(polariscope, 20000, "[16, 160]")));  // Rows are kept 64 at a time.

TEST_F(KeptWork, AShardThatIsKilledContinues) {
  make(lit_scene);
  make_shards(2);
  const std::string whole = contents(shard(2));
  const Arguments part = render_shard(2, 2, {"--checkpoint", "0.01", "--threads", "1"});
  std::filesystem::remove(in_folder(shard(2)));
  EXPECT_EQ(end_by(SIGKILL, shard(2) + ".checkpoint", part).status, 128 + SIGKILL);
  run_well(joined(part, {"--resume"}));
  EXPECT_TRUE(contents(shard(2)) == whole);
}

/// The first shard has it; others may take it from there, and merge does.
TEST_F(KeptWork, ShardsHaveTheirLightFromTheFirst) {
  make(lit_scene);
  const auto make_shard = [](int i, const Arguments& more) {
    return render_shard(i, 3, joined({"--checkpoint", "0.01"}, more));
  };
  run_well(make_shard(1, {}));
  run_well(make_shard(2, {"--light", shard(1)}));
  run_well(make_shard(3, {}));
  EXPECT_NE(contents(shard(1)).find(light_name), std::string::npos);
  EXPECT_EQ(contents(shard(2)).find(light_name), std::string::npos);
  run_well(merge({shard(3), shard(2), shard(1)}));
  expect_same("a");
  expect_error("of another render", make_shard(3, {"--light", shard(1), "--seed", "7"}));
  expect_error("is the same file as --light", make_shard(3, {"--light", shard(3)}));
  EXPECT_THAT(said(make_shard(3, {"--light", shard(2)})), HasSubstr("2.shard has no light"));
  expect_error("none.shard", make_shard(3, {"--light", "none.shard"}), 1);
}

TEST_F(KeptWork, AnInterruptedRenderWritesWhatItHas) {
  std::signal(SIGHUP, SIG_DFL);  // Where nohup runs the tests, it is ignored.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    std::filesystem::remove(in_folder("a.png.checkpoint"));  // The first one is written when tiles are done.
    const Outcome outcome = end_by(signal);
    EXPECT_EQ(outcome.status, 130);
    EXPECT_THAT(outcome.error, HasSubstr("the same command continues from"));
    EXPECT_TRUE(has("a.png") && has("a.exr"));
  }
  run_well(render("a", {"--resume"}));
  expect_same("a");
}

/// A render that was quicker than the request is tried again.
TEST_F(KeptWork, ARequestWritesAPictureAndTheRenderGoesOn) {
  for (const std::string& scene : {std::string(path_scene), plate_scene(gaussian_photons, 150000)}) {
    make(scene);
    for (bool is_seen = false; !is_seen && !HasFailure();) {
      std::filesystem::remove(in_folder("a.exr"));
      const pid_t child = start_until("a.png.checkpoint", render("a", {"--checkpoint", "0.01", "--threads", "1"}));
      kill(child, SIGUSR1);
      while (!has("a.exr") && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      is_seen = has("a.exr") && !is_equal("a.exr", "whole.exr");
      EXPECT_EQ(wait_for(child).status, 0);
      expect_same("a");
    }
  }
}

/// The same scene continues by itself and says so in one line; that of another scene stays under another name.
TEST_F(KeptWork, ACheckpointIsContinuedOrSetAside) {
  end_by(SIGKILL);
  const std::string kept = contents("a.png.checkpoint");
  EXPECT_THAT(said(render("a")), HasSubstr("/a.png.checkpoint\n"));
  expect_same("a");
  EXPECT_FALSE(has("a.png.checkpoint"));
  EXPECT_THAT(said(render("a")), Not(HasSubstr("checkpoint")));
  for (const char* name : {"a.png.checkpoint.1", "a.png.checkpoint.2"}) {
    write("a.png.checkpoint", kept);
    EXPECT_THAT(said(render("a", {"--seed", "7"})),
                HasSubstr("`/seed` is not given there, 7 here; it is kept as " + in_folder(name).string()));
    EXPECT_FALSE(is_equal("a.exr", "whole.exr"));
    EXPECT_TRUE(contents(name) == kept);
  }
  write("a.png.checkpoint", kept);
  for (const std::string& bytes : {std::string("no checkpoint"), kept.substr(0, kept.size() / 2), forged()}) {
    write("a.png.checkpoint", bytes);
    EXPECT_THAT(said(render("a")), HasSubstr("it is kept as "));
    expect_same("a");
  }
}

/// Of the field's file, the contents count, not the time: it may be copied.
TEST_F(KeptWork, ACheckpointOfAnotherRenderIsRefusedWhereItMustBeContinued) {
  expect_error("--resume: there is no checkpoint ", render("a", {"--resume"}));
  end_by(SIGKILL);
  expect_error("`/seed` is not given there, 7 here", render("a", {"--resume", "--seed", "7"}));
  expect_error("`/camera/resolution`", render("a", {"--resume", "--set", "camera.resolution=[9,9]"}));
  expect_error("method is", render("a", {"--resume", "--set", "integrator.type=lens"}));
  const std::string field = contents("field.vdb"), kept = contents("a.png.checkpoint");
  run_well({"make", "vortex", "-o", "field.vdb", "--resolution", "17"});
  expect_error("the file `/field/file` has other contents", render("a", {"--resume"}));
  write("field.vdb", field);
  write("a.png.checkpoint", forged());
  expect_error("a.png.checkpoint: ", render("a", {"--resume"}), 1);
  write("a.png.checkpoint", kept);
  run_well(render("a", {"--resume"}));
  expect_same("a");
}

TEST_F(KeptWork, AFullDiskLeavesTheOldCheckpoint) {
  end_by(SIGKILL);
  const std::string kept = contents("a.png.checkpoint");
  const Outcome outcome = run(render("a", {"--resume", "--checkpoint", "0.01"}), "ulimit -f 4; exec");
  EXPECT_EQ(outcome.status, 1) << outcome.error;  // There is no room for the picture, either.
  EXPECT_THAT(outcome.error, HasSubstr("warning: no checkpoint"));
  EXPECT_TRUE(contents("a.png.checkpoint") == kept);
  EXPECT_FALSE(has("a.png.checkpoint.new"));
  EXPECT_FALSE(has("a.exr"));
  run_well(render("a", {"--resume"}));
  expect_same("a");
}

TEST_F(KeptWork, ShardsThatDoNotFitAreNamed) {
  make_shards(3);
  expect_error("missing shard 2/3", merge({"1.shard", "3.shard"}));
  expect_error("3.shard and 3.shard are both shard 3/3", merge({"1.shard", "2.shard", "3.shard", "3.shard"}));
  run_well(render_shard(2, 3, {"--seed", "3"}));
  expect_error("2.shard: is of another render than the first shard: `/seed`", merge({"1.shard", "2.shard", "3.shard"}));
  run_well(render_shard(2, 4));
  expect_error("2.shard: is one of 4 shards", merge({"1.shard", "2.shard", "3.shard"}));
  expect_error("scene.json: is no checkpoint or shard", merge({"scene.json"}), 1);
  expect_error("--shard 4/3", render_shard(4, 3));
  expect_error("--shard: name one file", render("a", {"--shard", "1/3"}));
  run_well(render_shard(2, 3));
  run_well(merge({"1.shard", "2.shard", "3.shard"}));
  expect_same("a");
}

/// As other outputs do: a link stays, a device is written to, and no file is that of the checkpoint.
TEST_F(KeptWork, AShardIsAnOutputLikeOthers) {
  const auto make_shard = [](const std::string& file) {
    return Arguments{"render", "scene.json", "-q", "--shard", "1/2", "-o", file};
  };
  std::filesystem::create_symlink("1.shard", in_folder("link"));
  run_well(make_shard("link"));
  EXPECT_TRUE(std::filesystem::is_symlink(in_folder("link")) && has("1.shard"));
  make_pipe("pipe");
  const pid_t child = start(make_shard("pipe"));
  EXPECT_TRUE(contents("pipe") == contents("1.shard"));
  EXPECT_EQ(wait_for(child).status, 0);
  EXPECT_TRUE(std::filesystem::is_fifo(in_folder("pipe")));
  write("2.shard.new", "somebody's");
  run_well(make_shard("2.shard"));
  EXPECT_EQ(contents("2.shard.new"), "somebody's");
  expect_error("the checkpoint", joined(make_shard("3.shard"), {"--stats", "3.shard.checkpoint"}));
  expect_error("the checkpoint", render("a", {"--stats", "a.png.checkpoint"}));
}

/// A frame that was interrupted has files, which are not its picture.
TEST_F(KeptWork, ASequenceContinuesAtTheFrameThatWasInterrupted) {
  const auto frames = [&](const std::string& name, const Arguments& more = {}) {
    return joined(render(name + ".#", {"--set", R"(camera.angle={"keys":[[1,20],[3,30]]})", "--frames", "1-3"}), more);
  };
  run_well(frames("all"));
  EXPECT_EQ(end_by(SIGINT, "a.2.png.checkpoint", frames("a", {"--checkpoint", "0.01"})).status, 130);
  EXPECT_TRUE(has("a.2.png"));
  EXPECT_FALSE(has("a.3.png"));
  run_well(frames("a", {"--skip-existing", "--resume"}));
  for (const char* name : {".1.png", ".2.png", ".3.png", ".1.exr", ".2.exr", ".3.exr"})
    EXPECT_TRUE(is_equal("a" + std::string(name), "all" + std::string(name))) << name;
}

}  // namespace
}  // namespace tensorray
