// tools/render_array, with programs in the PATH that stand for those of queues, and run their tasks at once.

#include <cstdlib>

#include <fmt/core.h>

#include "tests/data_folder.h"
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

  /// Runs the script. @return its exit status.
  int render_array(const std::string& arguments, const std::string& environment = "") const {
    const std::string command = fmt::format(
        "cd '{0}' && PATH='{0}/bin':\"$PATH\" TENSORRAY='{1}' {2} '{3}' {4} >out 2>error", in_folder("").string(),
        TENSORRAY_BINARY, environment, (source_folder() / "tools/render_array").string(), arguments);
    return WEXITSTATUS(std::system(command.c_str()));
  }

  void expect_whole_picture() const {
    run_well({"render", "scene.json", "-q", "-o", "whole.exr", "-o", "whole.png", "--set",
              R"(camera={"resolution": [40, 30]})"});
    for (const char* ending : {".exr", ".png"})
      EXPECT_TRUE(read_file(in_folder("a" + std::string(ending))) ==
                  read_file(in_folder("whole" + std::string(ending))))
          << ending;
  }

  const std::string scene_and_pictures =
      R"(3 scene.json -o a.exr --set 'camera={"resolution": [40, 30]}' --output a.png -q)";
};

TEST_F(RenderArray, SlurmMergesWhatItsTasksMake) {
  put_in_path("sbatch", sbatch);
  ASSERT_EQ(render_array("--with 'sbatch --partition=night' " + scene_and_pictures), 0)
      << read_file(in_folder("error"));
  expect_whole_picture();
  const std::string queue = read_file(in_folder("queue.log"));
  EXPECT_EQ(queue.find("--partition=night --parsable --array=1-3 "), 0U) << queue;
  EXPECT_NE(queue.find("\n--partition=night --dependency=afterok:17 "), std::string::npos) << queue;
}

TEST_F(RenderArray, ParallelMergesWhatItsTasksMake) {
  put_in_path("parallel", parallel);
  ASSERT_EQ(render_array("--with 'parallel --jobs 1' " + scene_and_pictures), 0) << read_file(in_folder("error"));
  expect_whole_picture();
  EXPECT_EQ(read_file(in_folder("queue.log")).find("--jobs 1 -q -I @TASK@ "), 0U);
}

TEST_F(RenderArray, MergesNothingWhereATaskFails) {
  put_in_path("sbatch", sbatch);
  put_in_path("parallel", parallel);
  for (const char* queue : {"sbatch", "parallel"}) {
    EXPECT_NE(render_array(fmt::format("--with {} 2 nowhere.json -o a.exr", queue)), 0) << queue;
    EXPECT_NE(read_file(in_folder("error")).find("nowhere.json"), std::string::npos) << queue;
    EXPECT_EQ(read_file(in_folder("error")).find(".shard"), std::string::npos) << queue;
  }
}

TEST_F(RenderArray, MergesShardsOfAnotherQueue) {
  const std::string options = R"(3 scene.json -q --set 'camera={"resolution": [40, 30]}')";
  for (const char* task : {"TASK=1", "TASK=2"}) EXPECT_EQ(render_array(options, task), 0) << task;
  EXPECT_EQ(render_array("--merge 3 -q -o a.exr -o a.png"), 1);
  EXPECT_NE(read_file(in_folder("error")).find("part3.shard"), std::string::npos);
  EXPECT_EQ(render_array(options, "TASK=3"), 0);
  EXPECT_EQ(render_array("--merge 3 -q -o a.exr -o a.png"), 0) << read_file(in_folder("error"));
  expect_whole_picture();
}

TEST_F(RenderArray, SaysWhatIsMissing) {
  for (const auto& [arguments, text] :
       std::vector<std::pair<std::string, std::string>>{{"", "number of shards"},
                                                        {"some scene.json", "number of shards"},
                                                        {"3", "scene file"},
                                                        {"3 scene.json", "TASK"},
                                                        {"--merge 3", "name the pictures"},
                                                        {"--with sbatch 3 scene.json", "name the pictures"},
                                                        {"--with qsub 3 scene.json -o a.png", "qsub is neither"},
                                                        {"--with", "name the queue's command"}}) {
    EXPECT_EQ(render_array(arguments), 2) << arguments;
    const std::string error = read_file(in_folder("error"));
    EXPECT_NE(error.find(text), std::string::npos) << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
  }
}

}  // namespace
}  // namespace tensorray
