/// Whole renders, by the program `tensorray` beside this one: what a user waits for. renders.json has the questions,
/// their scenes and ways; paths in it are relative to a folder in which `scenes` is that of the project.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <nlohmann/json.hpp>

#include "base/files/temporary_folder.h"
#include "renderer/film/spectral_image.h"
#include "renderer/images/image.h"
#include "tools/benchmark/questions.h"

namespace tensorray::bench {
namespace {

using Json = nlohmann::ordered_json;
using Arguments = std::vector<std::string>;

/// Runs `tensorray ARGUMENTS...` in the folder. @throw std::runtime_error if it fails; the program prints why.
void run_program(const TemporaryFolder& folder, const Arguments& arguments) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").replace_filename("tensorray");
  std::string command = "cd '" + (folder / "").string() + "' && '" + program.string() + "'";
  for (const std::string& argument : arguments) command += " '" + argument + "'";
  command += " > /dev/null";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command + " failed");
}

/// Renders a scene of a question. @return the statistics (`--stats`).
Json render(const TemporaryFolder& folder, const Json& question, const Json& scene, const Arguments& options) {
  std::ofstream(folder / "scene.json") << scene;
  Arguments arguments{"render", "scene.json", "--quiet", "--stats", "statistics.json"};
  for (const std::string output : question.at("outputs")) arguments.insert(arguments.end(), {"-o", output});
  arguments.insert(arguments.end(), options.begin(), options.end());
  run_program(folder, arguments);
  std::ifstream file(folder / "statistics.json");
  return Json::parse(file);
}

/// The root mean square of the difference to the picture that the question takes for exact, as a part of that of the
/// picture. The exact picture is made where it is first compared.
double error_of(const TemporaryFolder& folder, const Json& question, const Json& scene) {
  static std::map<std::string, Image> exact;
  const Image picture = read_image(folder / "picture.exr");
  const std::string key = question.at("name").get<std::string>() + scene.dump();
  if (exact.count(key) == 0) {
    render(folder, question, scene, question.at("exact"));
    exact[key] = read_image(folder / "picture.exr");
  }
  return relative_distance(picture, exact[key]);
}

void measure(benchmark::State& state, const Json& question, const Json& scene, const Arguments& options) {
  const TemporaryFolder folder;
  std::filesystem::create_directory_symlink(TENSORRAY_SCENES, folder / "scenes");
  const std::string field = scene.at("field").value("file", "");
  if (question.contains("files")) run_program(folder, question["files"].at(field));
  if (!field.empty() && !exists(folder / field)) return state.SkipWithError("the field's file is not there");
  const Json& phases = question.at("time");
  for (auto _ : state) {
    const Json statistics = render(folder, question, scene, options);
    double time = 0;
    for (const auto& [phase, seconds] : statistics.at("seconds").items()) {
      if (std::find(phases.begin(), phases.end(), phase) != phases.end()) time += seconds.get<double>();
      if (phase != "total" && seconds > 0.005) state.counters[phase] = seconds.get<double>();
    }
    state.SetIterationTime(time);
    state.counters["positions"] = statistics.value("positions", 0.0);
    if (statistics.contains("error")) state.counters["estimate_percent"] = 100 * statistics["error"].get<double>();
    if (question.contains("exact")) state.counters["error_percent"] = 100 * error_of(folder, question, scene);
  }
}

}  // namespace

void add_renders() {
  std::ifstream file(TENSORRAY_RENDERS);
  for (const Json& question : Json::parse(file))
    for (const auto& [name, changes] : question.at("cases").items())
      for (const auto& [way, options] : question.at("ways").items()) {
        Json scene = question.at("scene");
        scene.merge_patch(changes);
        const auto run = [question, scene, options = options.get<Arguments>()](benchmark::State& state) {
          measure(state, question, scene, options);
        };
        const std::string title = question.at("name").get<std::string>() + "/" + name + "/" + way;
        benchmark::RegisterBenchmark(title.c_str(), run)->Iterations(1)->UseManualTime()->Unit(benchmark::kSecond);
      }
}

}  // namespace tensorray::bench
