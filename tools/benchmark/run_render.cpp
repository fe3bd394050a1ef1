#include "tools/benchmark/run_render.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace tensorray::bench {

void run_program(const TemporaryFolder& folder, const std::vector<std::string>& arguments) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").replace_filename("tensorray");
  std::string command = "cd '" + (folder / "").string() + "' && '" + program.string() + "'";
  for (const std::string& argument : arguments) command += " '" + argument + "'";
  command += " > /dev/null";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command + " failed");
}

Json run_render(const TemporaryFolder& folder, const Json& scene, const std::vector<std::string>& outputs,
                const std::vector<std::string>& options) {
  std::ofstream(folder / "scene.json") << scene;
  std::vector<std::string> arguments{"render", "scene.json", "--quiet", "--stats", "statistics.json"};
  for (const std::string& output : outputs) arguments.insert(arguments.end(), {"-o", output});
  arguments.insert(arguments.end(), options.begin(), options.end());
  run_program(folder, arguments);
  std::ifstream file(folder / "statistics.json");
  return Json::parse(file);
}

}  // namespace tensorray::bench
