// Sequences of frames, and renders that a queue divides.

#include "tests/program/divided_scenes.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

class Frames : public Program {
 protected:
  void SetUp() override {
    run_well({"make", "point_load", "-o", "load.0001.vdb", "--resolution", "9"});
    run_well({"make", "vortex", "-o", "load.0003.vdb", "--resolution", "9"});
    write("scene.json", R"({"field": {"file": "load.0001.vdb"})" + rest_);
  }

  const std::string rest_ = R"(, "light": {"photons": 500, "wavelengths": {"count": 4},
      "direction": {"keys": [[1, [0, 0, -1]], [3, [0, 1, -1]]]}},
      "receiver": {"resolution": [24, 24]}, "integrator": {"type": "photon_distribution"}})";
};

TEST_F(Frames, KeyframesAndNumberedFieldsAreFollowed) {
  write("scene.json", R"({"field": {"file": "load.####.vdb", "scale": 2})" + rest_);
  run_well({"render", "scene.json", "--frames", "1-3x2", "-o", "out.##.exr", "--stats", "out.##.json", "-q"});
  for (const std::string number : {"1", "3"}) {
    const std::string direction = number == "1" ? "[0,0,-1]" : "[0,1,-1]";
    run_well(joined({"render", "scene.json", "-o", "alone.exr", "-q"},
                    changes({"light.direction=" + direction, "field.file=load.000" + number + ".vdb"})));
    EXPECT_EQ(pixels("out.0" + number + ".exr"), pixels("alone.exr")) << number;
    EXPECT_TRUE(has("out.0" + number + ".json"));
  }
  EXPECT_FALSE(has("out.02.exr"));
  EXPECT_NE(pixels("out.01.exr"), pixels("out.03.exr"));
  expect_error("load.0002.vdb", {"render", "scene.json", "--frames", "2", "-q"});
}

TEST_F(Frames, TheAutomaticScaleIsThatOfTheFirstFrame) {
  run_well({"render", "scene.json", "--frames", "1-3", "-q"});  // The field is loaded once.
  run_well({"render", "scene.json", "--frames", "1", "--stats", "stats.json", "-o", "first.exr", "-q"});
  const json scale = read_json("stats.json")["field"]["scale"];
  EXPECT_EQ(pixels("scene.0001.exr"), pixels("first.exr"));
  run_well(joined({"render", "scene.json", "-o", "last.exr", "-q"},
                  changes({"light.direction=[0,1,-1]", "field.scale=" + scale.dump()})));
  EXPECT_GT(scale, 0);
  EXPECT_EQ(pixels("scene.0003.exr"), pixels("last.exr"));
}

TEST_F(Frames, ExistingFramesAreLeftOutOnRequest) {
  run_well({"render", "scene.json", "--frames", "1-2", "-o", "a.#.exr", "-q"});
  const std::vector<float> second = pixels("a.2.exr");
  write("a.1.exr", "kept");
  std::filesystem::remove(in_folder("a.2.exr"));
  run_well({"render", "scene.json", "--frames", "1-2", "-o", "a.#.exr", "--skip-existing", "-q"});
  EXPECT_EQ(contents("a.1.exr"), "kept");
  EXPECT_EQ(pixels("a.2.exr"), second);
}

/// Without --keep-going, the first frame that fails ends the run.
TEST_F(Frames, ABadFrameStopsNoOthersOnRequest) {
  write("scene.json", R"({"field": {"file": "load.####.vdb"})" + rest_);
  run_well({"make", "helix", "-o", "load.0005.vdb", "--resolution", "9"});
  const Arguments arguments{"render", "scene.json", "--frames", "0,1,3-5,2", "-o", "a.%02d.exr", "-q"};
  EXPECT_EQ(run(arguments).status, 1);
  for (const std::string& name : files()) EXPECT_NE(name[0], 'a') << name;

  const Outcome outcome = run(joined(arguments, {"--keep-going"}));
  EXPECT_EQ(outcome.status, 1);
  for (const std::string frame : {"01", "03", "05"}) EXPECT_TRUE(has("a." + frame + ".exr"));
  EXPECT_THAT(outcome.error, AllOf(HasSubstr("tensorray: frame 0: "), HasSubstr("tensorray: frame 4: "),
                                   HasSubstr("tensorray: frame 2: "),
                                   HasSubstr("tensorray: 3 frames failed: 0, 4, 2; render again with --frames 0,4,2")));
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 4) << outcome.error;

  // No frame is well: each is named.
  const Outcome none = run({"render", "scene.json", "--frames", "4,0", "-o", "c.#.exr", "-q", "--keep-going"});
  EXPECT_EQ(none.status, 1);
  EXPECT_THAT(none.error, AllOf(HasSubstr("tensorray: frame 4: "), HasSubstr("tensorray: frame 0: "),
                                HasSubstr("tensorray: 2 frames failed: 4, 0;")));
  expect_error("unknown key `/field/files`",
               {"render", "scene.json", "--frames", "4,0", "-o", "c.#.exr", "--keep-going", "--set", "field.files=1"});

  // A frame whose scene is wrong, and not its files.
  const Outcome wrong =
      run(joined({"render", "scene.json", "--frames", "1-3", "--keep-going", "-q", "-o", "b.$F.exr"},
                 changes({R"(light.photons={"keys":[[1,500],[2,-1],[3,500]]})", "field.file=load.0001.vdb"})));
  EXPECT_EQ(wrong.status, 1);
  EXPECT_THAT(wrong.error, HasSubstr("tensorray: 1 frame failed: 2;"));
  EXPECT_TRUE(has("b.1.exr") && has("b.3.exr"));
}

TEST_F(Frames, MistakesAreNamed) {
  expect_error("`/light/direction` has keyframes: give --frames", {"render", "scene.json", "-q"});
  expect_error("each frame would replace it", {"render", "scene.json", "--frames", "1-2", "-o", "one.exr"});
  expect_error("s.json", {"render", "scene.json", "--frames", "1-2", "-o", "a.#.exr", "--stats", "s.json"});
  expect_error("--frames 2-1", {"render", "scene.json", "--frames", "2-1"});
  for (const Arguments& option : {Arguments{"-o", "a.%04d.exr"}, {"--set", "output.exr=a.$F4.exr"}, {"--stats", "$F"}})
    expect_error("has the number of a frame; give --frames",
                 joined({"render", "scene.json", "--set", "light.direction=[0,0,-1]"}, option));
  expect_error("--save-scene", {"render", "scene.json", "--frames", "1-2", "--save-scene", "copy.json"});
  const Outcome piped = run({"render", "/dev/stdin", "--frames", "1-2", "-o", "a.#.exr"}, "cat scene.json |");
  expect_one_line(piped, "a pipe is read once", 2);
}

// tools/render_array, with programs in the PATH that stand for those of queues, and run their tasks at once.

/// Keeps its options in a file, and copies the script, as Slurm does.
constexpr const char* sbatch = R"(#!/bin/bash
echo "$*" >>queue.log
while [[ $1 = --* ]]; do
  case $1 in --array=1-*) tasks=${1#--array=1-} ;; esac
  shift
done
cp "$1" job
export SLURM_CPUS_PER_TASK=1
if [ -z "${tasks:-}" ]; then ./job "${@:2}"; exit; fi
for task in $(seq "$tasks"); do SLURM_ARRAY_TASK_ID=$task ./job "${@:2}" >&2 || exit; done
echo '17;cluster'
)";

/// Options that follow `-I @TASK@` are the command.
constexpr const char* parallel = R"(#!/bin/bash
echo "$*" >>queue.log
while [ "$1" != -I ]; do shift; done
command=("${@:3}")
for task in $(cat); do "${command[@]//@TASK@/$task}" || failed=1; done
exit "${failed:-0}"
)";

class RenderArray : public Program {
 protected:
  void SetUp() override {
    write("scene.json", path_scene);
    run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "17"});
  }

  void put_in_path(const std::string& name, const std::string& program) const {
    write("bin/" + name, program);
    std::filesystem::permissions(in_folder("bin/" + name), std::filesystem::perms::owner_all);
  }

  Outcome render_array(const std::string& arguments, const std::string& variables = "") const {
    return run_script(
        "render_array", arguments,
        fmt::format("PATH='{}':\"$PATH\" TENSORRAY='{}' {}", in_folder("bin").string(), TENSORRAY_BINARY, variables));
  }

  /// The script has merged the pictures of one render.
  void expect_pictures(const Outcome& outcome) const {
    ASSERT_EQ(outcome.status, 0) << outcome.error;
    run_well({"render", "scene.json", "-q", "-o", "whole.exr", "-o", "whole.png", "--set",
              R"(camera={"resolution": [40, 30]})"});
    EXPECT_TRUE(is_equal("a.exr", "whole.exr") && is_equal("a.png", "whole.png"));
  }

  const std::string scene_and_pictures =
      R"(3 scene.json -o a.exr --set 'camera={"resolution": [40, 30]}' --output a.png -q)";
};

TEST_F(RenderArray, SlurmMergesWhatItsTasksMake) {
  put_in_path("sbatch", sbatch);
  expect_pictures(render_array("--with 'sbatch --partition=night' " + scene_and_pictures));
  const std::string queue = contents("queue.log");
  EXPECT_THAT(queue, StartsWith("--partition=night --parsable --array=1-3 "));
  EXPECT_THAT(queue, HasSubstr("\n--partition=night --dependency=afterok:17 "));
}

TEST_F(RenderArray, ParallelMergesWhatItsTasksMake) {
  put_in_path("parallel", parallel);
  expect_pictures(render_array("--with 'parallel --jobs 1' " + scene_and_pictures));
  EXPECT_THAT(contents("queue.log"), StartsWith("--jobs 1 -q -I @TASK@ "));
}

TEST_F(RenderArray, MergesNothingWhereATaskFails) {
  put_in_path("sbatch", sbatch);
  put_in_path("parallel", parallel);
  for (const char* queue : {"sbatch", "parallel"}) {
    const Outcome outcome = render_array(fmt::format("--with {} 2 nowhere.json -o a.exr", queue));
    EXPECT_NE(outcome.status, 0) << queue;
    EXPECT_THAT(outcome.error, AllOf(HasSubstr("nowhere.json"), Not(HasSubstr(".shard")))) << queue;
  }
}

TEST_F(RenderArray, MergesShardsOfAnotherQueue) {
  const std::string options = R"(3 scene.json -q --set 'camera={"resolution": [40, 30]}')";
  for (const char* task : {"TASK=1", "TASK=2"}) EXPECT_EQ(render_array(options, task).status, 0) << task;
  const Outcome outcome = render_array("--merge 3 -q -o a.exr -o a.png");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.error, HasSubstr("part3.shard"));
  EXPECT_EQ(render_array(options, "TASK=3").status, 0);
  expect_pictures(render_array("--merge 3 -q -o a.exr -o a.png"));
}

TEST_F(RenderArray, SaysWhatIsMissing) {
  const std::pair<std::string, std::string> wrong[] = {{"", "number of shards"},
                                                       {"some scene.json", "number of shards"},
                                                       {"3", "scene file"},
                                                       {"3 scene.json", "TASK"},
                                                       {"--merge 3", "name the pictures"},
                                                       {"--with sbatch 3 scene.json", "name the pictures"},
                                                       {"--with qsub 3 scene.json -o a.png", "qsub is neither"},
                                                       {"--with", "name the queue's command"}};
  for (const auto& [arguments, text] : wrong) expect_one_line(render_array(arguments), text, 2);
}

}  // namespace
}  // namespace tensorray
