#pragma once

#include <string>

namespace tensorray::test {

/// A scene that renders quickly; `field` is the value of the key `field`.
inline std::string small_scene(const std::string& field = R"({"generate": {"kind": "point_load", "resolution": 17}})") {
  return R"({"field": )" + field + R"(,
             "light": {"photons": 2000, "wavelengths": {"count": 4}},
             "receiver": {"resolution": [32, 32]},
             "integrator": {"type": "photon_distribution", "density": {"kind": "gaussian", "tau": 2}}})";
}

}  // namespace tensorray::test
