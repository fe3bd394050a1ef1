// `mpirun -n 4 tensorray render`: the files are those of one process, whatever happens.

#include <optional>

#include "tests/program/divided_scenes.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

struct RankCase {
  std::string scene;
  std::vector<std::string> endings;  // Of the files.
  int ranks = 2;
};

class RanksProgram : public Program {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(TENSORRAY_MPIRUN)) GTEST_SKIP() << "mpirun is not installed";
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "17"});
  }

  /// Starts ranks with the test's folder as working folder. @return mpirun's process.
  pid_t start_ranks(int ranks, const Arguments& arguments) const {
    // What Open MPI leaks is not the program's: with the address sanitizer, leaks are not looked for.
    const std::string shell =
        fmt::format(R"(ASAN_OPTIONS="$ASAN_OPTIONS:detect_leaks=0" exec '{}' --oversubscribe --bind-to none -n {})",
                    TENSORRAY_MPIRUN, ranks);
    return start(joined({"render", "scene.json"}, arguments), shell);
  }

  void render_with_ranks(int ranks, const Arguments& arguments) const {
    const Outcome outcome = wait_for(start_ranks(ranks, arguments));
    EXPECT_EQ(outcome.status, 0) << outcome.error;
  }

  void expect_same(const std::string& a, const std::string& b) const { EXPECT_TRUE(is_equal(a, b)) << a << ", " << b; }

  /// The process of a rank, which works in the test's folder; none if it has not begun.
  std::optional<pid_t> process_of(int rank) const {
    const std::filesystem::path here = std::filesystem::canonical(in_folder(""));
    const std::string name = fmt::format("OMPI_COMM_WORLD_RANK={}", rank) + '\0';
    std::error_code none;
    for (const auto& process : std::filesystem::directory_iterator("/proc", none))
      if (std::filesystem::read_symlink(process.path() / "cwd", none) == here &&
          bytes_of(process.path() / "environ").find(name) != std::string::npos)
        return std::stoi(process.path().filename().string());
    return std::nullopt;
  }
};

/// Each method: tiles with the light before them, the light on a plate, lens, stretch; and files without a picture.
TEST_F(RanksProgram, GiveTheFilesOfOneProcess) {
  const RankCase cases[] = {
      {lit_scene, {"png", "exr"}, 2},
      {plate_scene(gaussian_photons), {"exr"}, 1},  // This one does not load MPI.
      {plate_under_paths("gaussian"), {"exr", "vtp", "ply"}, 2},
      {plate_scene(R"({"type": "photon_distribution"})"), {"png", "exr", "spectral.exr", "vtp", "fluence.vdb"}, 3},
      {plate_scene(lens), {"png", "exr", "spectral.exr"}, 2},
      {plate_scene(stretch), {"exr", "vdb"}, 2},
      {plate_scene(polariscope), {"exr", "spectral.exr"}, 2},
  };
  for (const RankCase& each : cases) {
    SCOPED_TRACE(each.scene);
    write("scene.json", each.scene);
    Arguments alone{"render", "scene.json", "-q", "--stats", "one.json"},
        together{"-q", "--threads", "1", "--stats", "a.json"};
    for (const std::string& ending : each.endings) {
      alone.insert(alone.end(), {"-o", "one." + ending});
      together.insert(together.end(), {"-o", "a." + ending});
    }
    run_well(alone);
    render_with_ranks(each.ranks, together);
    for (const std::string& ending : each.endings) expect_same("a." + ending, "one." + ending);
    const json one = read_json("one.json"), many = read_json("a.json");
    if (each.ranks == 1) continue;
    EXPECT_EQ(many["ranks"]["count"], each.ranks);
    if (each.scene == lit_scene) continue;  // Each rank counts its own ways through the field.
    for (const char* key : {"positions", "photons"}) EXPECT_EQ(many[key], one[key]) << key;
  }
}

/// Each rank renders every so many; those that fail are named once.
TEST_F(RanksProgram, DivideTheFramesOfASequence) {
  write("scene.json", R"({"field": {"file": "field.vdb"}, "integrator": {"type": "photon_distribution"},
      "light": {"photons": {"keys": [[3, 500], [4, -1], [5, 500]]}, "wavelengths": {"count": 4},
                "direction": {"keys": [[1, [0, 0, -1]], [5, [0, 1, -1]]]}},
      "receiver": {"resolution": [24, 24]}})");
  const Outcome alone = run({"render", "scene.json", "-q", "--frames", "1-5", "--keep-going", "-o", "one.#.exr"});
  EXPECT_EQ(alone.status, 1);
  const Outcome together = wait_for(start_ranks(3, {"--frames", "1-5", "--keep-going", "-o", "a.#.exr"}));
  EXPECT_EQ(together.status, 1);
  for (const int frame : {1, 2, 3, 5}) expect_same(fmt::format("a.{}.exr", frame), fmt::format("one.{}.exr", frame));
  for (const std::string& error : {alone.error, together.error})
    EXPECT_THAT(error, HasSubstr("1 frame failed: 4; render again with --frames 4"));
}

/// Nobody reads the pipe, so that no job ends by itself, however quick the machine is: it waits there with all of its
/// work, and with both ranks.
TEST_F(RanksProgram, AKilledRankEndsTheJobWhichContinuesToTheSameFiles) {
  write("scene.json", path_scene);
  run_well({"render", "scene.json", "-q", "-o", "one.png", "-o", "one.exr"});
  make_pipe("pipe");
  for (const int rank : {1, 0}) {
    std::filesystem::remove(in_folder("a.png.checkpoint"));
    const pid_t job = start_ranks(
        2, {"-q", "-o", "a.png", "-o", "a.exr", "--threads", "1", "--checkpoint", "0.01", "--stats", "pipe"});
    while (!has("a.png.checkpoint") && is_running(job)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::optional<pid_t> process = process_of(rank);
    ASSERT_TRUE(process) << contents("stderr");
    kill(*process, SIGKILL);
    const Outcome outcome = wait_for(job);
    EXPECT_NE(outcome.status, 0);  // The other does not wait for it.
    while (process_of(0) || process_of(1)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_THAT(outcome.error, HasSubstr(fmt::format("rank {}", rank)));
    EXPECT_TRUE(has("a.png.checkpoint"));
    EXPECT_FALSE(is_equal("a.exr", "one.exr"));
  }
  render_with_ranks(2, {"--resume", "-q", "-o", "a.png", "-o", "a.exr"});
  expect_same("a.png", "one.png");
  expect_same("a.exr", "one.exr");
  EXPECT_FALSE(has("a.png.checkpoint"));
}

TEST_F(RanksProgram, ErrorsOfASceneAreSaidOnce) {
  write("scene.json", R"({"field": {"file": "none.vdb"}, "integrator": {"type": "lens"}})");
  const Outcome outcome = wait_for(start_ranks(3, {"-o", "a.png"}));
  EXPECT_NE(outcome.status, 0);
  EXPECT_THAT(outcome.error, AllOf(HasSubstr("none.vdb"), Not(testing::ContainsRegex("none.vdb(.|\n)*none.vdb"))));
}

}  // namespace
}  // namespace tensorray
