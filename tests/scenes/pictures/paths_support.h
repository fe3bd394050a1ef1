#pragma once
/// @file tests/scenes/pictures/paths_support.h
/// Renders small pictures of paths, and measures them.

#include "tests/scenes/pictures/pictures.h"

namespace tensorray::test {

/// A scene that renders quickly. The volume reaches from -1 to 1, and from -2 to 0 along z.
constexpr const char* small_paths =
    R"({"field": {"generate": {"kind": "point_load", "resolution": 9}, "scale": 6},
             "light": {"photons": 500, "wavelengths": {"count": 4}},
             "receiver": {"resolution": [16, 16]},
             "integrator": {"type": "path_tracing", "seeds": {"count": 16}, "max_samples": 4, "noise": 0,
                            "filter": "box"},
             "camera": {"resolution": [24, 16]}})";

/// The covered area of the picture, in pixels.
inline double covered(const Image& image) { return sum(channel(image, "A")); }

constexpr const char* seen_from_the_side =
    R"(camera={"position": [0, -6, 2], "target": [0, 0, -1], "resolution": [24, 16]})";
constexpr const char* transparent = "integrator.background=transparent";
constexpr const char* without_box = "integrator.context.box=false";

class Paths : public Pictures {
 protected:
  Paths() { write("scene.json", small_paths); }
};

}  // namespace tensorray::test
