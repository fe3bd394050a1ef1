// `tensorray render --memory`: fields in files that the process maps.

#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

class Memory : public Program {
 protected:
  static std::string scene(const std::string& field) {
    return R"({"field": )" + field + R"(, "light": {"photons": 20000, "wavelengths": {"count": 3}},
               "receiver": {"resolution": [128, 128]},
               "integrator": {"type": "photon_distribution", "density": {"kind": "gaussian"}}})";
  }
};

TEST_F(Memory, AFieldInAFileGivesTheSamePictures) {
  run_well({"make", "point_load", "-o", "load.vdb", "--resolution", "40"});
  for (const char* field :
       {R"({"generate": {"kind": "vortex", "resolution": 40}})", R"({"file": "load.vdb", "smooth": 1})",
        R"({"file": "load.vdb", "name": "point_load_row0", "derive": "gradient", "eigenvalues": "raw"})"}) {
    write("scene.json", scene(field));
    run_well({"render", "scene.json", "-q", "-o", "all.exr"});
    run_well({"render", "scene.json", "-q", "-o", "part.exr", "--memory", "1M"});
    EXPECT_TRUE(read_file(in_folder("all.exr")) == read_file(in_folder("part.exr"))) << field;
  }
  EXPECT_EQ(files(), (std::vector<std::string>{"all.exr", "load.vdb", "part.exr", "scene.json"}));
}

#ifndef TENSORRAY_SANITIZED  // A sanitizer has memory of its own.
/// The limit is of the memory that is not a file's.
TEST_F(Memory, AFieldMayBeLargerThanTheMemory) {
  if (std::filesystem::space(in_folder("")).available < (std::uintmax_t{2} << 30))
    GTEST_SKIP() << "the test needs 2 GB on the disk of " << in_folder("");
  write("scene.json", scene(R"({"generate": {"kind": "point_load", "resolution": 200}, "eigenvalues": "raw"})"));
  const std::string limit = "ulimit -d 300000; exec";
  const std::vector<std::string> render = {"render", "scene.json", "-q", "--threads", "2", "-o"};
  const auto status_with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), render.begin(), render.end());
    return wait_for(start_in(limit, more)).status;
  };
  EXPECT_EQ(status_with({"a.exr"}), 2);
  EXPECT_EQ(status_with({"a.exr", "--memory", "64M"}), 0);
}
#endif

/// The first process is stopped in the midst of a long render, and killed, while others use its field.
TEST_F(Memory, ProcessesOfAMachineHaveOneFieldInCommon) {
  const std::string note = "another process";
  write("scene.json", scene(R"({"generate": {"kind": "vortex", "resolution": 40}, "scale": 1})"));
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

}  // namespace
}  // namespace tensorray
