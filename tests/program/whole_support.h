#pragma once
/// @file tests/program/whole_support.h
/// Renders small pictures of the method "scene".

#include <algorithm>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "renderer/images/image.h"
#include "tests/program/support.h"

namespace tensorray::test {

class WholeScene : public Program {
 protected:
  /// A small point load with all default objects and lights.
  void SetUp() override {
    Program::SetUp();
    write("scene.json", R"({
      "field": {"generate": {"kind": "point_load", "resolution": 17}, "eigenvalues": "absolute"},
      "integrator": {"type": "scene", "max_samples": 4, "min_samples": 4, "noise": 0,
                     "caustic": {"resolution": 64, "rays": 4000, "passes": 1}},
      "camera": {"resolution": [40, 32]}})");
  }

  Image picture(const std::vector<std::string>& sets, const std::string& threads = "2") {
    std::vector<std::string> arguments{"render", "scene.json", "-q", "-o", "out.exr", "--threads", threads};
    for (const std::string& set : sets) arguments.insert(arguments.end(), {"--set", set});
    run_well(arguments);
    return read_image(in_folder("out.exr"));
  }

  static double mean(const Image& image, const std::string& channel) {
    const auto at = std::find(image.channels.begin(), image.channels.end(), channel) - image.channels.begin();
    double sum = 0;
    for (std::size_t i = static_cast<std::size_t>(at); i < image.pixels.size(); i += image.channels.size())
      sum += image.pixels[i];
    return sum / image.width / image.height;
  }

  /// The changes, and a field so weak that light hardly bends.
  static std::vector<std::string> weakened(std::vector<std::string> sets) {
    sets.push_back("field.scale=1e-7");
    return sets;
  }

  /// A weak field gives the mean colours of a scene in which nothing bends, though light is found in other ways.
  /// @return the picture with the weak field.
  Image expect_weak_as_none(const std::vector<std::string>& sets, double tolerance = 0.02) {
    std::vector<std::string> none = sets;
    none.insert(none.end(), {"bending.a=0", "bending.b=0"});
    const Image with = picture(weakened(sets)), without = picture(none);
    for (const char* channel : {"R", "G", "B"})
      EXPECT_NEAR(mean(with, channel) / mean(without, channel), 1, tolerance) << channel;
    return with;
  }

  /// A wedge with a roof's slopes, whose ridge is at (x, y, z).
  void write_roof(const std::string& name, double x, double y, double z) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 8\nproperty list uchar int vertex_indices\nend_header\n";
    for (const double side : {-1.0, 1.0}) {
      text += fmt::format("{} {} {}\n{} {} {}\n", x - 0.5, y + 0.5 * side, z - 0.4, x + 0.5, y + 0.5 * side, z - 0.4);
      text += fmt::format("{} {} {}\n", x, y + 0.5 * side, z);
    }
    write(name, text + "3 0 1 2\n3 3 5 4\n3 0 2 3\n3 2 5 3\n3 1 4 2\n3 2 4 5\n3 0 3 1\n3 1 3 4\n");
  }

  void expect_error(const std::string& set, const std::string& part) {
    const Outcome outcome = run({"render", "scene.json", "-q", "--set", set});
    EXPECT_NE(outcome.status, 0) << set;
    EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }
};

}  // namespace tensorray::test
