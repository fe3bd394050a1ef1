#pragma once
/// @file tests/program/paths_support.h
/// Renders small pictures of paths, and measures them.

#include <algorithm>
#include <cmath>
#include <regex>
#include <sstream>

#include <Eigen/Core>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray::test {

using Settings = std::vector<std::string>;

constexpr const char* point_load = R"("kind": "point_load", "resolution": 9)";
constexpr const char* zero = R"("kind": "constant", "resolution": 9, "tensor": [[0, 0, 0], [0, 0, 0], [0, 0, 0]])";

/// A scene that renders quickly. The volume reaches from -1 to 1; that of the point load from -2 to 0 along z.
inline std::string small_paths(const std::string& kind = point_load) {
  return R"({"field": {"generate": {)" + kind + R"(}, "scale": 6},
             "light": {"photons": 500, "wavelengths": {"count": 4}},
             "receiver": {"resolution": [16, 16]},
             "integrator": {"type": "path_tracing", "seeds": {"count": 16}, "max_samples": 4, "noise": 0,
                            "filter": "box"},
             "camera": {"resolution": [24, 16]}})";
}

inline const std::vector<std::string> all_channels{
    "R",        "G",        "B",        "A",    "Z",     "normal.X", "normal.Y", "normal.Z",
    "albedo.R", "albedo.G", "albedo.B", "path", "force", "length",   "samples",  "variance"};

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

inline double sum(const std::vector<float>& values) {
  double total = 0;
  for (const float value : values) total += static_cast<double>(value);
  return total;
}

inline float greatest(const std::vector<float>& values) { return *std::max_element(values.begin(), values.end()); }

inline void expect_finite(const Image& image, const std::string& what) {
  for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value)) << what;
}

/// The covered area of the picture, in pixels.
inline double covered(const Image& image) { return sum(channel(image, "A")); }

constexpr const char* seen_from_the_side =
    R"(camera={"position": [0, -6, 2], "target": [0, 0, -1], "resolution": [24, 16]})";
constexpr const char* transparent = "integrator.background=transparent";
constexpr const char* without_box = "integrator.context.box=false";

class Paths : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("scene.json", small_paths());
  }

  static std::vector<std::string> arguments(const Settings& outputs, const Settings& settings) {
    std::vector<std::string> result{"render", "scene.json", "-q"};
    for (const std::string& output : outputs) result.insert(result.end(), {"-o", output});
    for (const std::string& setting : settings) result.insert(result.end(), {"--set", setting});
    return result;
  }

  /// Renders the scene-linear picture. All values must be finite.
  Image render(const Settings& settings, Settings outputs = {}) {
    outputs.push_back("out.exr");
    run_well(arguments(outputs, settings));
    Image image = read_image(in_folder("out.exr"));
    expect_finite(image, settings.empty() ? "" : settings.back());
    return image;
  }

  /// Runs the program, which must fail with one line that matches `pattern`, and must leave no new file.
  void expect_error(int status, const std::string& pattern, const Settings& settings,
                    const Settings& outputs = {"out.png", "out.exr", "out.vtp", "out.ply"}) {
    const auto before = files();
    const Outcome outcome = run(arguments(outputs, settings));
    EXPECT_EQ(outcome.status, status) << outcome.error;
    EXPECT_TRUE(std::regex_search(outcome.error, std::regex(pattern))) << outcome.error << "\nexpected " << pattern;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_EQ(files(), before);
  }

  /// Positions of an .obj file's vertices.
  std::vector<Eigen::Vector3d> vertices(const std::string& name) {
    std::istringstream text(read_file(in_folder(name)));
    std::vector<Eigen::Vector3d> positions;
    for (std::string line; std::getline(text, line);) {
      std::istringstream words(line);
      std::string word;
      Eigen::Vector3d position;
      if (words >> word && word == "v" && words >> position.x() >> position.y() >> position.z())
        positions.push_back(position);
    }
    return positions;
  }
};

}  // namespace tensorray::test
