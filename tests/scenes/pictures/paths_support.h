#pragma once
/// @file tests/scenes/pictures/paths_support.h
/// Renders small pictures of paths, and measures them.

#include <sstream>

#include <Eigen/Core>

#include "tests/scenes/pictures/pictures.h"

namespace tensorray::test {

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

/// The covered area of the picture, in pixels.
inline double covered(const Image& image) { return sum(channel(image, "A")); }

constexpr const char* seen_from_the_side =
    R"(camera={"position": [0, -6, 2], "target": [0, 0, -1], "resolution": [24, 16]})";
constexpr const char* transparent = "integrator.background=transparent";
constexpr const char* without_box = "integrator.context.box=false";

class Paths : public Pictures {
 protected:
  Paths() { write("scene.json", small_paths()); }

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
