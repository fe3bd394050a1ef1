// `tensorray render --memory`: fields that are larger than what may be resident.

#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

#ifdef TENSORRAY_SANITIZED  // A sanitizer has memory of its own: the process's is not measured then.
constexpr int bound = 768;  // MiB
constexpr bool is_measured = false;
#else
constexpr int bound = 256;
constexpr bool is_measured = true;
#endif

class Memory : public Program {
 protected:
  static std::string scene(const std::string& field) {
    return R"({"field": )" + field + R"(, "light": {"photons": 20000, "wavelengths": {"count": 8}},
               "receiver": {"resolution": [128, 128]},
               "integrator": {"type": "photon_distribution", "density": {"kind": "gaussian"}}})";
  }

  /// Makes all.exr and part.exr of scene.json, and their statistics.
  void render_with_and_without_the_bound() const {
    run_well({"render", "scene.json", "-q", "-o", "all.exr", "--stats", "all.json"});
    run_well({"render", "scene.json", "-q", "-o", "part.exr", "--stats", "part.json", "--memory",
              std::to_string(bound) + "M", "--threads", "1"});
    EXPECT_TRUE(read_file(in_folder("all.exr")) == read_file(in_folder("part.exr")));
  }
};

TEST_F(Memory, AFieldOfEightTimesTheBoundGivesTheSameFiles) {
  if (std::filesystem::space(in_folder("")).available < (std::uintmax_t{5} << 30))
    GTEST_SKIP() << "the test needs 5 GB on the disk of " << in_folder("");
  run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "322"});
  write("scene.json", scene(R"({"file": "field.vdb", "eigenvalues": "raw", "scale": 4})"));
  render_with_and_without_the_bound();
  const nlohmann::json all = read_json("all.json"), part = read_json("part.json");
  if (is_measured) {
    EXPECT_GE(part["field"]["memory_bytes"], 8.0 * (bound << 20));
    EXPECT_GT(all["peak_memory_bytes"], 8.0 * (bound << 20));
    // What rays touch before the process looks again depends on how busy the machine is; PageMemory tests the bound.
    EXPECT_LT(2 * part["peak_memory_bytes"].get<double>(), all["peak_memory_bytes"].get<double>());
  }
  RecordProperty("seconds_without", all["seconds"].dump());
  RecordProperty("seconds_with", part["seconds"].dump());
  for (const std::string& name : files()) EXPECT_NE(name.rfind(".tensorray", 0), 0u) << name;
}

/// The samples that tensors are derived from have the bound, too.
TEST_F(Memory, DerivedTensorsAreTheSame) {
  run_well({"make", "point_load", "-o", "field.vdb", "--resolution", "190"});
  write("scene.json",
        scene(R"({"file": "field.vdb", "name": "point_load_row0", "derive": "gradient", "eigenvalues": "raw",
                  "scale": 0.5})"));
  render_with_and_without_the_bound();
  if (is_measured) {
    EXPECT_LT(read_json("part.json")["peak_memory_bytes"], read_json("all.json")["peak_memory_bytes"]);
  }
}

/// A field that fits is not slower, and also fields that are made within the bound are the same.
TEST_F(Memory, SmallFieldsAreTheSame) {
  write("scene.json", scene(R"({"generate": {"kind": "vortex", "resolution": 40}})"));
  run_well({"render", "scene.json", "-q", "-o", "all.exr"});
  run_well({"render", "scene.json", "-q", "-o", "part.exr", "--memory", "1G"});
  EXPECT_TRUE(read_file(in_folder("all.exr")) == read_file(in_folder("part.exr")));
}

/// The first process is stopped in the midst of a long render, and killed, while others use its field.
TEST_F(Memory, ProcessesOfAMachineHaveOneFieldInCommon) {
  const std::string field = R"({"generate": {"kind": "vortex", "resolution": 40}, "scale": 1})",
                    note = "another process";
  write("scene.json", scene(field));
  const std::vector<std::string> render = {"render", "scene.json", "--memory", "1G", "-o"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), render.begin(), render.end());
    return more;
  };
  std::filesystem::create_directory(in_folder("tmp"));
  const std::string shell = "export TMPDIR=\"$PWD/tmp\"; ";
  const auto notes_of = [&](const std::string& name) {
    const Outcome outcome = wait_for(start_in(shell + "exec", with({name})));
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return outcome.error;
  };
  EXPECT_EQ(notes_of("alone.exr").find(note), std::string::npos);

  const pid_t first =
      start_in(shell + "exec 2>first.log; exec", with({"first.exr", "--set", "light.photons=4000000000"}));
  while (read_file(in_folder("first.log")).find("voxels") == std::string::npos) {
    ASSERT_EQ(waitpid(first, nullptr, WNOHANG), 0) << read_file(in_folder("first.log"));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  kill(first, SIGSTOP);
  EXPECT_NE(notes_of("shared.exr").find(note), std::string::npos);
  kill(first, SIGKILL);
  wait_for(first);
  EXPECT_EQ(notes_of("again.exr").find(note), std::string::npos);

  for (const char* name : {"shared.exr", "again.exr"})
    EXPECT_TRUE(read_file(in_folder("alone.exr")) == read_file(in_folder(name))) << name;
  EXPECT_TRUE(std::filesystem::is_empty(in_folder("tmp")));
}

TEST_F(Memory, WhatCannotFitIsSaid) {
  write("scene.json", scene(R"({"generate": {"kind": "vortex", "resolution": 9}})"));
  const std::pair<const char*, const char*> wrong[] = {
      {"100M", "--memory 100.0 MiB: the program takes as much beside its field; give 256.0 MiB at least"},
      {"much", "--memory"}};
  for (const auto& [size, text] : wrong) {
    const Outcome outcome = run({"render", "scene.json", "-o", "a.exr", "--memory", size});
    EXPECT_EQ(outcome.status, 2) << size;
    EXPECT_NE(outcome.error.find(text), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_FALSE(std::filesystem::exists(in_folder("a.exr")));
  }
}

}  // namespace
}  // namespace tensorray
