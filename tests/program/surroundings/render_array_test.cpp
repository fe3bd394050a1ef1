// tools/render_array, with programs in the PATH that stand for those of queues, and run their tasks at once.

#include <fmt/core.h>

#include "tests/program/divided_scenes.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

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
    Program::SetUp();
    write("scene.json", path_scene);
    run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "17"});
  }

  void put_in_path(const std::string& name, const std::string& program) const {
    std::filesystem::create_directories(in_folder("bin"));
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
  const std::string queue = read_file(in_folder("queue.log"));
  EXPECT_EQ(queue.find("--partition=night --parsable --array=1-3 "), 0U) << queue;
  EXPECT_NE(queue.find("\n--partition=night --dependency=afterok:17 "), std::string::npos) << queue;
}

TEST_F(RenderArray, ParallelMergesWhatItsTasksMake) {
  put_in_path("parallel", parallel);
  expect_pictures(render_array("--with 'parallel --jobs 1' " + scene_and_pictures));
  EXPECT_EQ(read_file(in_folder("queue.log")).find("--jobs 1 -q -I @TASK@ "), 0U);
}

TEST_F(RenderArray, MergesNothingWhereATaskFails) {
  put_in_path("sbatch", sbatch);
  put_in_path("parallel", parallel);
  for (const char* queue : {"sbatch", "parallel"}) {
    const Outcome outcome = render_array(fmt::format("--with {} 2 nowhere.json -o a.exr", queue));
    EXPECT_NE(outcome.status, 0) << queue;
    EXPECT_NE(outcome.error.find("nowhere.json"), std::string::npos) << queue;
    EXPECT_EQ(outcome.error.find(".shard"), std::string::npos) << queue;
  }
}

TEST_F(RenderArray, MergesShardsOfAnotherQueue) {
  const std::string options = R"(3 scene.json -q --set 'camera={"resolution": [40, 30]}')";
  for (const char* task : {"TASK=1", "TASK=2"}) EXPECT_EQ(render_array(options, task).status, 0) << task;
  const Outcome outcome = render_array("--merge 3 -q -o a.exr -o a.png");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.error.find("part3.shard"), std::string::npos);
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
