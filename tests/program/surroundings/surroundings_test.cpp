// Places where a program can be put, and what each command makes of them: its result, or one line and no file.

#include <cstdlib>
#include <map>
#include <utility>

#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

/// How a command ends: with status 0 and its result, or else with a line that has this text, and without a file.
struct End {
  int status = 0;
  const char* line = "";
};

struct Place {
  const char* name;
  const char* shell;                ///< Commands before the program; the last word runs it.
  std::map<std::string, End> ends;  ///< Of commands; "" of all others.
  const char* folder = ".";         ///< For the results, within that of the test.
  bool shows_errors = true;         ///< Whether standard error is a file.
};

/// A command and the files that it makes, which must have the same bytes everywhere.
struct Command {
  const char* name;
  std::vector<std::string> arguments;  ///< RESULTS and INPUTS are folders.
  std::vector<std::string> files;
};

const std::vector<Command> commands{
    {"render",
     {"render", "INPUTS/scene.json", "-o", "RESULTS/a.png", "--checkpoint", "0.001", "--stats", "RESULTS/a.stats"},
     {"a.png"}},
    {"merge", {"merge", "INPUTS/1.shard", "INPUTS/2.shard", "-o", "RESULTS/m.png"}, {"m.png"}},
    {"import", {"import", "INPUTS/tensors.nrrd", "-o", "RESULTS/i.vdb"}, {"i.vdb"}},
    {"view", {"view", "INPUTS/scene.json", "--port", "0"}, {}}};

// Names of 255 bytes, which are the longest.
#define TEN "0123456789"
#define FIFTY TEN TEN TEN TEN TEN

const std::vector<Place> places{
    {"no environment", "exec env -i", {}},
    {"no HOME, a relative state folder", "unset HOME TERM; XDG_STATE_HOME=state exec", {}},
    {"standard error is closed", "exec 2>&-; exec", {}, ".", false},
    {"standard error is full", "exec 2>/dev/full; exec", {}, ".", false},
    {"standard output is closed", "exec >&-; exec", {{"view", {1, "standard output"}}}, ".", true},
    {"standard output is full", "exec >/dev/full; exec", {{"view", {1, "standard output"}}}, ".", true},
    {"all streams are closed", "exec <&- >&- 2>&-; exec", {{"view", {1, ""}}}, ".", false},
    {"a full disk",
     "ulimit -f 0; exec",
     {{"", {1, "cannot be written"}}, {"view", {1, "standard output"}}},
     ".",
     false},
    {"a working folder that is gone", "mkdir gone; cd gone; rmdir ../gone; exec", {}},
    {"another locale", "LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8 exec", {}},
    {"one processor", "exec taskset 1", {}},
    {"few descriptors", "ulimit -n 16; exec", {}},
    {"little stack", "ulimit -s 256; exec", {}},
    {"too little stack", "ulimit -s 64; exec", {{"", {1, "ulimit -s"}}}},
    {"a folder whose name is no UTF-8", "exec", {}, "\xff\xc3(\xed\xa0\x80"},
    {"a folder with the longest name", "exec", {}, FIFTY FIFTY FIFTY FIFTY FIFTY "01234"},
    {"a folder that is missing", "exec", {{"", {1, "there is no folder"}}, {"view", {}}}, "missing"}};

class Surroundings : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    std::filesystem::create_directories(in_folder("inputs"));
    write("inputs/scene.json", R"({"field": {"file": "field.vdb", "scale": 4}, "camera": {"resolution": [24, 20]},
        "integrator": {"type": "path_tracing", "max_samples": 4, "min_samples": 4, "seeds": {"count": 9}}})");
    std::string tensors;
    for (int i = 0; i < 2 * 3 * 4; ++i) tensors += "1.5 0 0.25 2 0 3\n";
    write("inputs/tensors.nrrd",
          "NRRD0005\ntype: float\ndimension: 4\nspace: right-anterior-superior\nsizes: 6 2 3 4\n"
          "space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: 3D-symmetric-matrix space space space\n"
          "encoding: ascii\n\n" +
              tensors);
    run_well({"make", "point_load", "-o", "inputs/field.vdb", "--resolution", "9"});
    for (const char* part : {"1", "2"})
      run_well({"render", "inputs/scene.json", "-q", "--shard", std::string(part) + "/2", "-o",
                "inputs/" + std::string(part) + ".shard"});
  }

  std::vector<std::string> arguments_of(const Command& command, const std::filesystem::path& results) const {
    std::vector<std::string> arguments = command.arguments;
    for (std::string& each : arguments)
      for (const auto& [word, folder] : {std::pair{"RESULTS", results}, std::pair{"INPUTS", in_folder("inputs")}})
        if (each.rfind(word, 0) == 0) each.replace(0, std::string(word).size(), folder.string());
    return arguments;
  }

  /// Runs a command to its end; a view ends when it has printed its address.
  Outcome run_in(const Place& place, const Command& command, const std::filesystem::path& results) const {
    std::filesystem::remove(in_folder("stdout"));  // That of another run has an address, too.
    const pid_t child = start_in(place.shell, arguments_of(command, results));
    if (std::string(command.name) == "view") {
      while (is_running(child) && read_file(in_folder("stdout")).find("http://") == std::string::npos)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      kill(child, SIGTERM);
    }
    return wait_for(child);
  }

  static std::vector<std::string> names_in(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  void expect_end(const Place& place, const Command& command) const {
    const auto found = place.ends.find(command.name), others = place.ends.find("");
    const End end = found != place.ends.end() ? found->second : others != place.ends.end() ? others->second : End{};
    const std::string where = std::string(place.name) + ", " + command.name;
    const std::filesystem::path results = in_folder("results"), into = (results / place.folder).lexically_normal();
    std::filesystem::remove_all(results);
    std::filesystem::create_directories(results);
    if (std::string(place.folder) != "missing") std::filesystem::create_directories(into);

    const Outcome outcome = run_in(place, command, into);
    EXPECT_EQ(outcome.status, end.status) << where << ": " << outcome.error;
    if (end.status != 0 && place.shows_errors) {
      EXPECT_EQ(outcome.error.rfind("tensorray: "), 0u) << where << ": " << outcome.error;
      EXPECT_NE(outcome.error.find(end.line), std::string::npos) << where << ": " << outcome.error;
      EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << where << ": " << outcome.error;
    }
    std::vector<std::string> expected = end.status == 0 ? command.files : std::vector<std::string>();
    std::vector<std::string> made = names_in(into);
    made.erase(std::remove(made.begin(), made.end(), "a.stats"), made.end());
    EXPECT_EQ(made, expected) << where << ": " << outcome.error;
    if (end.status != 0) return;
    for (const std::string& file : command.files)
      EXPECT_TRUE(read_file(into / file) == read_file(in_folder("reference/" + file))) << where << ": " << file;
  }
};

TEST_F(Surroundings, GiveTheResultOrOneLine) {
  const bool has_page =
      std::filesystem::exists(std::filesystem::path(TENSORRAY_BINARY).parent_path().parent_path() / "view/view.js");
  std::filesystem::create_directories(in_folder("reference"));
  for (const Command& command : commands) {
    if (std::string(command.name) == "view" && !has_page) continue;  // tools/view builds it.
    EXPECT_EQ(run_in({"here", "exec", {}}, command, in_folder("reference")).status, 0) << command.name;
    for (const Place& place : places) expect_end(place, command);
  }
}

}  // namespace
}  // namespace tensorray
