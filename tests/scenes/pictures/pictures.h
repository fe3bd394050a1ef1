#pragma once
/// Renders small scenes as `tensorray render` does, in the process of the test.

#include <numeric>
#include <optional>
#include <regex>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "base/files/temporary_folder.h"
#include "base/process/progress.h"
#include "integrators/methods/read_scene.h"
#include "renderer/images/image.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tests/files.h"

namespace tensorray {
namespace test {}
using namespace test;
}  // namespace tensorray

namespace tensorray::test {

using Settings = std::vector<std::string>;

inline Settings joined(Settings first, const Settings& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

/// So many samples of each pixel.
inline Settings samples(int count) {
  return {"integrator.max_samples=" + std::to_string(count), "integrator.min_samples=" + std::to_string(count)};
}

/// The named channel of a picture, by pixel.
inline std::vector<float> channel(const Image& image, const std::string& name) {
  const auto found = std::find(image.channels.begin(), image.channels.end(), name);
  if (found == image.channels.end()) {
    ADD_FAILURE() << "no channel " << name;
    return {};
  }
  std::vector<float> values;
  for (auto i = static_cast<std::size_t>(found - image.channels.begin()); i < image.pixels.size();
       i += image.channels.size())
    values.push_back(image.pixels[i]);
  return values;
}

inline double sum(const std::vector<float>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

inline double mean(const Image& image, const std::string& name) {
  return sum(channel(image, name)) / image.width / image.height;
}

inline float greatest(const std::vector<float>& values) { return *std::max_element(values.begin(), values.end()); }

inline void expect_finite(const Image& image, const std::string& what = "") {
  for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value)) << what;
}

/// Makes a folder for each test, with scene.json, and removes it after the test.
class Pictures : public ::testing::Test {
 protected:
  std::filesystem::path in_folder(const std::string& name) const { return folder_ / name; }

  void write(const std::string& name, const std::string& text) const { write_bytes(in_folder(name), text); }

  /// Renders the scene and writes `outputs`; without any, no file.
  /// @param threads  0: all. @param scene  Relative to the folder.
  Render render_all(const Settings& settings, const Settings& outputs = {}, int threads = 0,
                    const std::filesystem::path& scene_file = "scene.json") {
    std::optional<tbb::global_control> control;
    if (threads > 0) control.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    SceneChanges changes{settings, {}};
    for (const std::string& output : outputs) changes.outputs.push_back(in_folder(output));
    const SceneDescription description = read_scene(in_folder("") / scene_file, changes);
    OutputFiles files;
    if (!outputs.empty()) files = open_outputs(description.output);
    const Scene scene = load_scene(description, Progress());
    Render result = tensorray::render(scene, Progress());
    notes_ = joined(joined(scene.notes, description.warnings), result.warnings);
    statistics_ = nlohmann::json::parse(statistics_json(scene, result.statistics, 0, threads));
    if (!outputs.empty()) write_outputs(result, scene, files);
    commit_outputs(std::move(files));
    return result;
  }

  /// The scene-linear picture, which is also in linear.exr if there are other outputs. All values must be finite.
  Image render(const Settings& settings, Settings outputs = {}, int threads = 0) {
    if (!outputs.empty()) outputs.emplace_back("linear.exr");
    Image image = render_all(settings, outputs, threads).linear;
    expect_finite(image, settings.empty() ? "" : settings.back());
    return image;
  }

  /// A render that must fail as wrong input (status 2) or otherwise (1), with one line that matches `pattern`.
  void expect_error(int status, const std::string& pattern, const Settings& settings, const Settings& outputs = {}) {
    int found = 0;
    const std::string line = message([&] {
      try {
        render_all(settings, outputs);
      } catch (const std::exception& error) {
        found = dynamic_cast<const std::invalid_argument*>(&error) ? 2 : 1;
        throw;
      }
    });
    EXPECT_EQ(found, status) << line << "\nexpected " << pattern;
    EXPECT_TRUE(std::regex_search(line, std::regex(pattern))) << line << "\nexpected " << pattern;
  }

  std::vector<std::string> notes_;  ///< Notes and warnings of the last render.
  nlohmann::json statistics_;       ///< Of the last render.

 private:
  const TemporaryFolder folder_;
};

}  // namespace tensorray::test
