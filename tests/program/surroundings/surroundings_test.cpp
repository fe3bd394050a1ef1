// Places where a program can be put, too few threads, and too little memory: what each command makes of them is its
// result, or one line and no file. Estimates of memory are near what is needed.

#include <map>
#include <regex>

#include "tests/program/support.h"

namespace tensorray {
namespace {

class Limits : public Program {
 protected:
  void SetUp() override {
#ifdef TENSORRAY_SANITIZED
    GTEST_SKIP() << "the address sanitizer needs terabytes of addresses";
#endif
    write("scene.json", small_scene());
  }

  /// Without further threads: a limit that does not bind root. Another user may not see the program's folder, or this
  /// one, but for a capability.
  static std::string without_threads() {
    const std::string user = geteuid() != 0 ? ""
                                            : "setpriv --reuid=65534 --regid=65534 --clear-groups "
                                              "--inh-caps=+dac_override --ambient-caps=+dac_override ";
    return "exec " + user + "prlimit --nproc=1";
  }

  Outcome render_in(const std::string& shell, const Arguments& more) const {
    return run(joined({"render", "scene.json", "-q", "-o", "a.png"}, more), shell);
  }
};

TEST_F(Limits, AreSaidInOneLine) {
  struct Case {
    std::string shell;
    Arguments more;
    int status;
    const char* line;
  };
  const std::string little = "ulimit -v 3000000; exec";
  const std::vector<Case> cases{
      {without_threads(), {}, 1, "Resource temporarily unavailable"},
      {little, changes({"receiver.resolution=[16000,16000]"}), 2, "`/receiver/resolution` needs about"},
      {little,
       joined({"-o", "a.spectral.exr"}, changes({"receiver.resolution=[5000,5000]", "light.wavelengths.count=64"})), 2,
       "needs about"},
      {little, changes({"integrator.type=lens", "receiver.resolution=[8000,8000]"}), 2, "ulimit -v"},
      {little, changes({"integrator.type=scene", "integrator.bands=64", "camera.resolution=[3000,3000]"}), 2,
       "needs about"},
      {little, changes({"integrator.type=path_tracing", "camera.resolution=[6000,6000]"}), 2, "needs about"},
      {little, changes({"integrator.type=scene", "camera.resolution=[6000,6000]"}), 2, "needs about"},
      {little, changes({"field.generate.resolution=600"}), 2, "resolution: the voxels need about"},
      {"ulimit -v 200000; exec", {"--threads", "2"}, 1, "threads can be started"}};
  for (const Case& each : cases) {
    const Outcome outcome = render_in(each.shell, each.more);
    expect_one_line(outcome, each.line, each.status);
    EXPECT_THAT(outcome.error, StartsWith("tensorray: "));
    EXPECT_FALSE(has("a.png"));
  }
}

TEST_F(Limits, OfProcessorsAreThoseOfTheRun) {
  for (const auto& [shell, threads] : {std::pair("exec taskset 1", "4"), {"exec", "1"}}) {
    const Outcome outcome = render_in(shell, {"--threads", threads, "--stats", "stats.json"});
    ASSERT_EQ(outcome.status, 0) << outcome.error;
    EXPECT_EQ(read_json("stats.json")["threads"], 1) << shell;
  }
}

/// "needs about 1.5 GiB", in bytes.
double needed_bytes(const std::string& error) {
  std::smatch match;
  if (!std::regex_search(error, match, std::regex("needs about ([0-9.]+) ([GM])iB"))) return NAN;
  return std::stod(match[1]) * (match[2] == "G" ? 0x1p30 : 0x1p20);
}

/// What a larger picture needs more than a smaller one: as it is estimated, and as it is measured.
TEST_F(Limits, EstimatesOfMemoryAreNearWhatIsMeasured) {
  struct Case {
    Arguments more;
    const char* key;
    int small, large;
  };
  const Arguments histogram = changes({R"(integrator.density={"kind":"histogram"})"}),
                  paths = changes({"integrator.type=path_tracing", "integrator.max_samples=1",
                                   "integrator.min_samples=1", "integrator.seeds.count=10"});
  for (const Case& each :
       {Case{histogram, "receiver.resolution", 1500, 3000}, Case{paths, "camera.resolution", 300, 1000}}) {
    double estimate[2], measured[2];
    for (const int i : {0, 1}) {
      const std::string size = fmt::format("{0}=[{1},{1}]", each.key, i == 0 ? each.small : each.large);
      const Arguments arguments = joined(each.more, {"--set", size});
      estimate[i] = needed_bytes(render_in("ulimit -d 120000; exec", arguments).error);
      const Outcome outcome = render_in("exec", joined(arguments, {"--stats", "stats.json"}));
      ASSERT_EQ(outcome.status, 0) << outcome.error;
      measured[i] = read_json("stats.json")["peak_memory_bytes"];
    }
    EXPECT_NEAR((estimate[1] - estimate[0]) / (measured[1] - measured[0]), 1, 1.0 / 3) << each.more[1];
  }
}

// `tensorray render --memory`: fields in files that the process maps.

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
    EXPECT_TRUE(is_equal("all.exr", "part.exr")) << field;
  }
  EXPECT_THAT(files(), ElementsAre("all.exr", "load.vdb", "part.exr", "scene.json"));
}

#ifndef TENSORRAY_SANITIZED  // A sanitizer has memory of its own.
/// The limit is of the memory that is not a file's.
TEST_F(Memory, AFieldMayBeLargerThanTheMemory) {
  if (std::filesystem::space(in_folder("")).available < (std::uintmax_t{2} << 30))
    GTEST_SKIP() << "the test needs 2 GB on the disk of " << in_folder("");
  write("scene.json", scene(R"({"generate": {"kind": "point_load", "resolution": 200}, "eigenvalues": "raw"})"));
  const auto status_with = [&](const Arguments& more) {
    const Arguments render{"render", "scene.json", "-q", "--threads", "2", "-o"};
    return run(joined(render, more), "ulimit -d 300000; exec").status;
  };
  EXPECT_EQ(status_with({"a.exr"}), 2);
  EXPECT_EQ(status_with({"a.exr", "--memory", "64M"}), 0);
}
#endif

/// Of tensors of any kind, with each interpolant.
class CommonField : public Memory, public testing::WithParamInterface<const char*> {};

/// The first process is stopped in the midst of a long render, and killed, while others use its field.
TEST_P(CommonField, OfAllProcessesOfAMachineIsOne) {
  const std::string note = "another process";
  write("scene.json", scene(GetParam()));
  const Arguments render{"render", "scene.json", "--memory", "1G", "-o"};
  std::filesystem::create_directory(in_folder("tmp"));
  const std::string shell = "export TMPDIR=\"$PWD/tmp\"; ";
  const auto notes_of = [&](const std::string& name) {
    const Outcome outcome = run(joined(render, {name}), shell + "exec");
    EXPECT_EQ(outcome.status, 0) << outcome.error;
    return outcome.error;
  };
  EXPECT_THAT(notes_of("alone.exr"), Not(HasSubstr(note)));

  const pid_t first =
      start(joined(render, {"first.exr", "--set", "light.photons=4000000000"}), shell + "exec 2>first.log; exec");
  while (contents("first.log").find("voxels") == std::string::npos) {
    ASSERT_EQ(waitpid(first, nullptr, WNOHANG), 0) << contents("first.log");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  kill(first, SIGSTOP);
  EXPECT_THAT(notes_of("shared.exr"), HasSubstr(note));
  kill(first, SIGKILL);
  wait_for(first);
  EXPECT_THAT(notes_of("again.exr"), Not(HasSubstr(note)));

  for (const char* name : {"shared.exr", "again.exr"}) EXPECT_TRUE(is_equal("alone.exr", name)) << name;
  EXPECT_TRUE(std::filesystem::is_empty(in_folder("tmp")));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, CommonField,
    testing::Values(
        R"({"generate": {"kind": "vortex", "resolution": 40}, "scale": 1})",
        R"({"generate": {"kind": "vortex", "resolution": 40}, "scale": 1, "border": "extend"})",
        R"({"generate": {"kind": "point_load", "resolution": 40}, "scale": 1, "interpolation": "linear"})"));

/// How a command ends: with status 0 and its result, or else without a file and with a line that has this text, which
/// may be null where nobody sees standard error.
struct End {
  int status = 0;
  const char* line = "";
};

struct Place {
  const char* name;
  const char* shell;                ///< Commands before the program; the last word runs it.
  std::map<std::string, End> ends;  ///< Of commands; "" of all others.
  std::string folder = ".";         ///< For the results, within that of the test.
};

/// A command and the files that it makes, which must have the same bytes everywhere.
struct Command {
  const char* name;
  Arguments arguments;  ///< RESULTS and INPUTS are folders.
  std::vector<std::string> files;
};

const std::vector<Command> commands{
    {"render",
     {"render", "INPUTS/scene.json", "-o", "RESULTS/a.png", "--checkpoint", "0.001", "--stats", "RESULTS/a.stats"},
     {"a.png"}},
    {"merge", {"merge", "INPUTS/1.shard", "INPUTS/2.shard", "-o", "RESULTS/m.png"}, {"m.png"}},
    {"import", {"import", "INPUTS/tensors.nrrd", "-o", "RESULTS/i.vdb"}, {"i.vdb"}},
    {"view", {"view", "INPUTS/scene.json", "--port", "0"}, {}}};

const std::vector<Place> places{
    {"no environment", "exec env -i", {}},
    {"no HOME, a relative state folder", "unset HOME TERM; XDG_STATE_HOME=state exec", {}},
    {"standard error is closed", "exec 2>&-; exec", {}},
    {"standard error is full", "exec 2>/dev/full; exec", {}},
    {"standard output is closed", "exec >&-; exec", {{"view", {1, "standard output"}}}},
    {"standard output is full", "exec >/dev/full; exec", {{"view", {1, "standard output"}}}},
    {"all streams are closed", "exec <&- >&- 2>&-; exec", {{"view", {1, nullptr}}}},
    {"a full disk", "ulimit -f 0; exec", {{"", {1, nullptr}}}},
    {"a working folder that is gone", "mkdir gone; cd gone; rmdir ../gone; exec", {}},
    {"another locale", "LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8 exec", {}},
    {"one processor", "exec taskset 1", {}},
    {"few descriptors", "ulimit -n 16; exec", {}},
    {"little stack", "ulimit -s 256; exec", {}},
    {"too little stack", "ulimit -s 64; exec", {{"", {1, "ulimit -s"}}}},
    {"a folder whose name is no UTF-8", "exec", {}, "\xff\xc3(\xed\xa0\x80"},
    {"a folder with the longest name", "exec", {}, std::string(255, 'x')},
    {"a folder that is missing", "exec", {{"", {1, "there is no folder"}}, {"view", {}}}, "missing"}};

class Surroundings : public Program {
 protected:
  void SetUp() override {
    write("inputs/scene.json", R"({"field": {"file": "field.vdb", "scale": 4}, "camera": {"resolution": [24, 20]},
        "integrator": {"type": "path_tracing", "max_samples": 4, "min_samples": 4, "seeds": {"count": 9}}})");
    write("inputs/tensors.nrrd", nrrd("2 3 4", repeated("1.5 0 0.25 2 0 3\n", 2 * 3 * 4)));
    run_well({"make", "point_load", "-o", "inputs/field.vdb", "--resolution", "9"});
    for (const std::string part : {"1", "2"})
      run_well({"render", "inputs/scene.json", "-q", "--shard", part + "/2", "-o", "inputs/" + part + ".shard"});
  }

  Arguments arguments_of(const Command& command, const std::filesystem::path& results) const {
    Arguments arguments = command.arguments;
    for (std::string& each : arguments)
      for (const auto& [word, folder] : {std::pair{"RESULTS", results}, std::pair{"INPUTS", in_folder("inputs")}})
        if (each.rfind(word, 0) == 0) each.replace(0, std::string(word).size(), folder.string());
    return arguments;
  }

  /// Runs a command to its end; a view ends when it has printed its address.
  Outcome run_at(const Place& place, const Command& command, const std::filesystem::path& results) const {
    std::filesystem::remove(in_folder("stdout"));  // That of another run has an address, too.
    const pid_t child = start(arguments_of(command, results), place.shell);
    if (std::string(command.name) == "view") {
      while (is_running(child) && contents("stdout").find("http://") == std::string::npos)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      kill(child, SIGTERM);
    }
    return wait_for(child);
  }

  void expect_end(const Place& place, const Command& command) const {
    const auto found = place.ends.find(command.name), others = place.ends.find("");
    const End end = found != place.ends.end() ? found->second : others != place.ends.end() ? others->second : End{};
    const std::string where = std::string(place.name) + ", " + command.name;
    const std::filesystem::path results = in_folder("results"), into = (results / place.folder).lexically_normal();
    std::filesystem::remove_all(results);
    std::filesystem::create_directories(results);
    if (place.folder != "missing") std::filesystem::create_directories(into);

    const Outcome outcome = run_at(place, command, into);
    EXPECT_EQ(outcome.status, end.status) << where << ": " << outcome.error;
    if (end.status != 0 && end.line) {
      EXPECT_THAT(outcome.error, StartsWith("tensorray: ")) << where;
      expect_one_line(outcome, end.line, end.status);
    }
    std::vector<std::string> expected = end.status == 0 ? command.files : std::vector<std::string>();
    std::vector<std::string> made = files("results/" + place.folder);
    made.erase(std::remove(made.begin(), made.end(), "a.stats"), made.end());
    EXPECT_EQ(made, expected) << where << ": " << outcome.error;
    if (end.status != 0) return;
    for (const std::string& file : command.files)
      EXPECT_TRUE(bytes_of(into / file) == contents("reference/" + file)) << where << ": " << file;
  }
};

TEST_F(Surroundings, GiveTheResultOrOneLine) {
  const bool has_page =
      std::filesystem::exists(std::filesystem::path(TENSORRAY_BINARY).parent_path().parent_path() / "view/view.js");
  std::filesystem::create_directories(in_folder("reference"));
  for (const Command& command : commands) {
    if (std::string(command.name) == "view" && !has_page) continue;  // tools/view builds it.
    EXPECT_EQ(run_at({"here", "exec", {}}, command, in_folder("reference")).status, 0) << command.name;
    for (const Place& place : places) expect_end(place, command);
  }
}

}  // namespace
}  // namespace tensorray
