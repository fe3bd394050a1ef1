// `mpirun -n 4 tensorray render`: the files are those of one process, whatever happens.

#include <cstdlib>
#include <optional>

#include <fmt/core.h>

#include "tests/program/divided_scenes.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

std::string mpirun() {
#ifdef TENSORRAY_MPIRUN
  return TENSORRAY_MPIRUN;
#else
  return "";
#endif
}

class RanksProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    if (mpirun().empty() || !std::filesystem::exists(mpirun())) GTEST_SKIP() << "mpirun is not installed";
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "17"});
  }

  /// Starts ranks with the test's folder as working folder. @return mpirun's process.
  pid_t start_ranks(int ranks, const std::string& arguments) const {
    // What Open MPI leaks is not the program's: with the address sanitizer, leaks are not looked for.
    const std::string command = fmt::format(
        "cd '{}' && ASAN_OPTIONS=\"$ASAN_OPTIONS:detect_leaks=0\" exec '{}' --oversubscribe --bind-to none -n {} '{}' "
        "render scene.json {} >out 2>error",
        in_folder("").string(), mpirun(), ranks, TENSORRAY_BINARY, arguments);
    const pid_t child = fork();
    if (child != 0) return child;
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }

  int wait_for_ranks(pid_t child) const {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  void render_with_ranks(int ranks, const std::string& arguments) const {
    EXPECT_EQ(wait_for_ranks(start_ranks(ranks, arguments)), 0) << error();
  }

  std::string error() const { return read_file(in_folder("error")); }

  void expect_same(const std::string& a, const std::string& b) const {
    ASSERT_TRUE(std::filesystem::exists(in_folder(a))) << a;
    EXPECT_TRUE(read_file(in_folder(a)) == read_file(in_folder(b))) << a << ", " << b;
  }

  /// The process that is a rank of mpirun's process; none if it has not begun.
  static std::optional<pid_t> process_of(pid_t parent, int rank) {
    const std::string name = fmt::format("OMPI_COMM_WORLD_RANK={}", rank) + '\0';
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
      const std::string number = entry.path().filename().string();
      if (number.find_first_not_of("0123456789") != std::string::npos) continue;
      const std::string stat = read_file(entry.path() / "stat");
      const std::size_t end = stat.rfind(')');
      if (end == std::string::npos || end + 4 >= stat.size() || std::atoi(stat.c_str() + end + 4) != parent) continue;
      if (read_file(entry.path() / "environ").find(name) != std::string::npos) return std::atoi(number.c_str());
    }
    return std::nullopt;
  }
};

TEST_F(RanksProgram, GiveTheFilesOfOneProcess) {
  for (const char* scene : {whole_scene, path_scene}) {
    write("scene.json", scene);
    run_well({"render", "scene.json", "-q", "-o", "one.png", "-o", "one.exr"});
    for (const int ranks : {1, 2, 3, 4}) {
      render_with_ranks(ranks, "-q -o a.png -o a.exr --threads 1 --stats stats.json");
      expect_same("a.png", "one.png");
      expect_same("a.exr", "one.exr");
      if (ranks == 1) continue;  // This one has not loaded MPI.
      const nlohmann::json traffic = read_json("stats.json")["ranks"];
      EXPECT_EQ(traffic["count"], ranks);
      std::uint64_t units = 0;
      for (const std::uint64_t each : traffic["units"]) units += each;
      EXPECT_EQ(units, scene == whole_scene ? 5u * 4u : 4u * 4u);
      const std::uint64_t words = 24 * traffic["messages"].get<std::uint64_t>();
      const bool is_lit = scene == whole_scene;
      // Of the sun's light in four bands, vertices of 33 wavelengths cross, and the sums and results of 32² pixels. The
      // scene's 1,000 vertices may become five thirds as many: a division adds up to five, and is taken for three.
      const unsigned vertices = is_lit ? 1000 * 5 / 3 * (9 * 33 + 4 * 5) : 0, plate = is_lit ? 8 * 4 * 35 * 32 : 0;
      // Each pixel crosses once: 120 bytes and 8 for each band, of the light and of what has landed, and few words.
      const unsigned pixels = is_lit ? 70 * 50 * (120 + 8 * 2 * 4) : 60 * 50 * (120 + 8 * 32);
      EXPECT_LE(traffic["bytes_received"], pixels + vertices + ranks * plate + words);
      EXPECT_LE(traffic["bytes_sent"], 4000u * ranks + 2 * (vertices + plate) + words);  // To two ranks at most.
    }
  }
}

/// Light that is made before the tiles. No rank makes it alone: what rank 0 sends is more than orders.
TEST_F(RanksProgram, MakeTheLightBeforeTheTilesTogether) {
  for (const std::string& scene : {std::string(lit_scene), plate_under_paths("mesh"), plate_under_paths("gaussian")}) {
    write("scene.json", scene);
    run_well({"render", "scene.json", "-q", "-o", "one.exr"});
    for (const int ranks : {2, 3}) {
      render_with_ranks(ranks, "-q -o a.exr --threads 1 --stats stats.json");
      expect_same("a.exr", "one.exr");
      const nlohmann::json traffic = read_json("stats.json")["ranks"];
      EXPECT_GT(traffic["bytes_sent"], 40 * 32 * 3 * 4) << scene;
      std::uint64_t units = 0;
      for (const std::uint64_t each : traffic["units"]) units += each;
      EXPECT_EQ(units, 3u * 2u);
    }
  }
}

/// Ranks of a machine map the same bricks, and leave nothing in the temporary folder.
TEST_F(RanksProgram, HaveOneFieldWithinABoundOfMemory) {
  write("scene.json", small_scene(R"({"generate": {"kind": "vortex", "resolution": 60}})"));
  run_well({"render", "scene.json", "-q", "-o", "one.exr"});
  std::filesystem::create_directory(in_folder("tmp"));
  setenv("TMPDIR", in_folder("tmp").c_str(), 1);
  render_with_ranks(3, "-q -o a.exr --threads 1 --memory 256M --stats stats.json");
  unsetenv("TMPDIR");
  expect_same("a.exr", "one.exr");
  for (const auto& entry : std::filesystem::directory_iterator(in_folder("tmp")))
    EXPECT_NE(entry.path().filename().string().rfind("tensorray-", 0), 0u) << entry.path();
}

/// A file of paths has no tiles, and no light before them.
TEST_F(RanksProgram, WriteFilesWithoutAPicture) {
  write("scene.json", plate_under_paths("mesh"));
  run_well({"render", "scene.json", "-q", "-o", "one.vtp", "-o", "one.ply"});
  render_with_ranks(2, "-q -o a.vtp -o a.ply");
  expect_same("a.vtp", "one.vtp");
  expect_same("a.ply", "one.ply");
}

struct SharedCase {
  const char* integrator;
  std::vector<std::string> endings;  // Of the pictures.
  std::string option;
};

/// The steps of light on a plate, of a lens, of stretch: all ranks trace it and draw it.
TEST_F(RanksProgram, MakeOnePictureTogether) {
  const SharedCase cases[] = {
      {R"({"type": "photon_distribution"})", {"png", "exr", "spectral.exr", "vtp"}, ""},
      {R"({"type": "photon_distribution"})", {"exr"}, "--until-error=20%"},
      {R"({"type": "lens", "samples": 2, "mode": "gather"})", {"png", "exr", "spectral.exr"}, ""},
      {R"({"type": "lens", "samples": 1, "mode": "scatter"})", {"exr"}, ""},
      {R"({"type": "photon_distribution", "density": {"kind": "gaussian", "tau": 2}})", {"png", "exr", "vtp"}, ""},
      {R"({"type": "photon_distribution", "density": {"kind": "histogram"}})", {"spectral.exr", "fluence.vdb"}, ""},
      {R"({"type": "photon_distribution", "density": {"kind": "photon_differential"}})", {"exr"}, ""},
      {R"({"type": "stretch"})", {"png", "exr", "vdb"}, ""},
  };
  for (const SharedCase& each : cases) {
    write(
        "scene.json",
        fmt::format(R"({{"field": {{"file": "field.vdb"}}, "light": {{"photons": 20000, "wavelengths": {{"count": 6}}}},
                                         "integrator": {}, "receiver": {{"resolution": [40, 32]}}}})",
                    each.integrator));
    std::vector<std::string> alone{"render", "scene.json", "-q", "--stats", "one.json"};
    std::string together = each.option + " -q --threads 1 --stats a.json";
    for (const std::string& ending : each.endings) {
      alone.insert(alone.end(), {"-o", "one." + ending});
      together += " -o a." + ending;
    }
    if (!each.option.empty()) alone.push_back(each.option);
    run_well(alone);
    const nlohmann::json one = read_json("one.json");
    for (const int ranks : {2, 3}) {
      render_with_ranks(ranks, together);
      for (const std::string& ending : each.endings) expect_same("a." + ending, "one." + ending);
      const nlohmann::json many = read_json("a.json");
      for (const char* key : {"positions", "photons", "ray_steps", "tensor_samples"})
        EXPECT_EQ(many[key], one[key]) << each.integrator << ' ' << key;
      EXPECT_EQ(many["ranks"]["count"], ranks);
      for (const std::uint64_t parts : many["ranks"]["units"]) EXPECT_GT(parts, 2u);
    }
  }
}

/// Methods without units of tiles: ranks take whole frames.
TEST_F(RanksProgram, DivideTheFramesOfASequence) {
  for (const char* method :
       {R"({"type": "photon_distribution"})", R"({"type": "lens", "samples": 1})", R"({"type": "stretch"})"}) {
    write("scene.json", fmt::format(R"({{"field": {{"file": "field.vdb"}}, "integrator": {},
        "light": {{"photons": 500, "wavelengths": {{"count": 4}},
                   "direction": {{"keys": [[1, [0, 0, -1]], [5, [0, 1, -1]]]}}}},
        "receiver": {{"resolution": [24, 24]}}}})",
                                    method));
    run_well({"render", "scene.json", "-q", "--frames", "1-5", "-o", "one.#.exr"});
    render_with_ranks(3, "--frames 1-5 -o a.#.exr");
    for (int frame = 1; frame <= 5; ++frame)
      expect_same(fmt::format("a.{}.exr", frame), fmt::format("one.{}.exr", frame));
    for (const auto& entry : std::filesystem::directory_iterator(in_folder("")))
      if (entry.path().extension() == ".exr") std::filesystem::remove(entry.path());
  }
}

TEST_F(RanksProgram, AKilledRankEndsTheJobWhichContinuesToTheSameFiles) {
  write("scene.json", whole_scene);
  const std::string more = " --set integrator.max_samples=384 --set integrator.min_samples=384 -q -o a.png -o a.exr";
  run_well({"render", "scene.json", "--set", "integrator.max_samples=384", "--set", "integrator.min_samples=384", "-q",
            "-o", "one.png", "-o", "one.exr"});
  for (const int rank : {2, 0}) {
    const pid_t job = start_ranks(3, "--threads 1 --checkpoint 0.05 --resume" + more);
    const auto checkpoint = in_folder("a.png.checkpoint");
    const auto before = std::filesystem::exists(checkpoint) ? read_file(checkpoint) : std::string();
    while (waitpid(job, nullptr, WNOHANG) == 0 &&
           (!std::filesystem::exists(checkpoint) || read_file(checkpoint) == before))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::optional<pid_t> process = process_of(job, rank);
    ASSERT_TRUE(process) << error();
    kill(*process, SIGKILL);
    EXPECT_NE(wait_for_ranks(job), 0);  // The others do not wait for it.
    EXPECT_NE(error().find(fmt::format("rank {}", rank)), std::string::npos) << error();
    EXPECT_TRUE(std::filesystem::exists(checkpoint));
    EXPECT_FALSE(std::filesystem::exists(in_folder("a.exr")) &&
                 read_file(in_folder("a.exr")) == read_file(in_folder("one.exr")));
  }
  render_with_ranks(2, "--resume" + more);
  expect_same("a.png", "one.png");
  expect_same("a.exr", "one.exr");
  EXPECT_FALSE(std::filesystem::exists(in_folder("a.png.checkpoint")));
}

TEST_F(RanksProgram, ErrorsOfASceneAreSaidOnce) {
  write("scene.json", R"({"field": {"file": "none.vdb"}, "integrator": {"type": "lens"}})");
  EXPECT_NE(wait_for_ranks(start_ranks(3, "-o a.png")), 0);
  const std::string text = error();
  const std::size_t first = text.find("none.vdb");
  EXPECT_NE(first, std::string::npos) << text;
  EXPECT_EQ(text.find("none.vdb", first + 1), std::string::npos) << text;
}

}  // namespace
}  // namespace tensorray
