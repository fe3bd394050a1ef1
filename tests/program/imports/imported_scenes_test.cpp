// The scenes of imported data. Their comments have the command that imports the data. These tests run exactly that
// command on the data sets of TENSORRAY_DATA.

#include <cctype>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "renderer/images/image.h"
#include "tests/data_folder.h"
#include "tests/program/support.h"

namespace tensorray {
namespace {

using namespace test;

std::vector<std::filesystem::path> imported_scenes() {
  std::vector<std::filesystem::path> scenes;
  for (const auto& entry : std::filesystem::directory_iterator(source_folder() / "scenes" / "imported"))
    if (entry.path().extension() == ".json") scenes.push_back(entry.path());
  return scenes;
}

/// The words after `tensorray` in the comment of a scene. Lines that end with a backslash are joined with the next.
std::vector<std::string> import_command(const std::filesystem::path& scene) {
  std::istringstream lines(read_file(scene));
  std::string command;
  for (std::string line; std::getline(lines, line);) {
    if (command.empty() && line.find("tensorray import ") == std::string::npos) continue;
    const bool goes_on = line.back() == '\\';
    command += line.substr(2, line.size() - 2 - (goes_on ? 1 : 0)) + " ";
    if (!goes_on) break;
  }
  std::istringstream text(command.substr(std::min(command.size(), command.find("import"))));
  std::vector<std::string> words;
  for (std::string word; text >> std::quoted(word);) words.push_back(word);
  return words;
}

/// The path of a file of the data sets, by its name; empty if there is no such file.
std::string data_file(const std::string& name) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data_folder()))
    if (entry.path().filename() == name) return entry.path().string();
  return {};
}

class ImportedScene : public Program, public ::testing::WithParamInterface<std::filesystem::path> {};

TEST_P(ImportedScene, IsImportedAsItSaysAndBendsLight) {
  if (!std::filesystem::is_directory(data_folder()))
    GTEST_SKIP() << "no data sets at " << data_folder() << "; TENSORRAY_DATA says where they are";
  std::vector<std::string> command = import_command(GetParam());
  ASSERT_GE(command.size(), 4u) << "no import command in the scene's comment";
  for (std::string& word : command) {
    const std::filesystem::path path(word);
    if (path.parent_path() == "scenes/imported")
      word = path.filename().string();
    else if (path.has_extension() && word[0] != '-' && !std::isdigit(static_cast<unsigned char>(word[0])))
      word = data_file(word);
  }
  run_well(command);
  std::filesystem::copy_file(GetParam(), in_folder("scene.json"));
  std::vector<std::string> render{"render", "scene.json", "-o", "out.exr"};
  std::vector<std::string> small{"light.photons=2000", "receiver.resolution=[64,64]", "light.wavelengths.count=8",
                                 "camera.resolution=[64,64]", "integrator.max_samples=4"};
  if (read_file(GetParam()).find("\"type\": \"scene\"") != std::string::npos)
    small.push_back("integrator.caustic.rays=20000");
  for (const std::string& change : small) render.insert(render.end(), {"--set", change});
  run_well(render);
  const Image image = read_image(in_folder("out.exr"));
  double sum = 0, greatest = 0;
  for (const float value : image.pixels) {
    ASSERT_TRUE(std::isfinite(value));
    greatest = std::max<double>(greatest, value);
    sum += value;
  }
  EXPECT_GT(greatest, 0.5);
  EXPECT_GT(sum, 0);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ImportedScene, ::testing::ValuesIn(imported_scenes()),
                         [](const auto& scene) { return scene.param.stem().string(); });

}  // namespace
}  // namespace tensorray
