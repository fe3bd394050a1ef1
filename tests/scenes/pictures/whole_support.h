#pragma once
/// @file tests/scenes/pictures/whole_support.h
/// Renders small pictures of the method "scene".

#include <fmt/core.h>

#include "tests/scenes/pictures/pictures.h"

namespace tensorray::test {

class WholeScene : public Pictures {
 protected:
  /// A small point load with all default objects and lights.
  WholeScene() {
    write("scene.json", R"({
      "field": {"generate": {"kind": "point_load", "resolution": 17}, "eigenvalues": "absolute"},
      "integrator": {"type": "scene", "max_samples": 4, "min_samples": 4, "noise": 0,
                     "caustic": {"resolution": 64, "rays": 4000, "passes": 1}},
      "camera": {"resolution": [40, 32]}})");
  }

  /// The changes, and a field so weak that light hardly bends.
  static Settings weakened(Settings sets) {
    sets.push_back("field.scale=1e-7");
    return sets;
  }

  /// A weak field gives the mean colours of a scene in which nothing bends, though light is found in other ways.
  /// @return the picture with the weak field.
  Image expect_weak_as_none(const Settings& sets, double tolerance = 0.02) {
    Settings none = sets;
    none.insert(none.end(), {"bending.a=0", "bending.b=0"});
    const Image with = render(weakened(sets)), without = render(none);
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
};

}  // namespace tensorray::test
