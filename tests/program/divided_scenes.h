#pragma once
/// @file tests/program/divided_scenes.h
/// Small scenes of all methods, of the field in field.vdb.

#include <string>
#include <vector>

#include <fmt/core.h>

namespace tensorray::test {

inline const char* const whole_scene = R"({
  "field": {"file": "field.vdb", "eigenvalues": "absolute", "scale": 4},
  "integrator": {"type": "scene", "max_samples": 16, "min_samples": 8, "bands": 4, "bands_per_sample": 4,
                 "caustic": {"resolution": 32, "rays": 1000, "passes": 1}},
  "camera": {"resolution": [70, 50]}})";

inline const char* const path_scene = R"({
  "field": {"file": "field.vdb", "eigenvalues": "absolute", "scale": 4},
  "integrator": {"type": "path_tracing", "max_samples": 64, "min_samples": 8, "noise": 0.01},
  "camera": {"resolution": [60, 50]}})";

/// A scene of light on a plate, of a lens or of stretch. @param integrator  The value of its key.
inline std::string plate_scene(const std::string& integrator, int photons = 20000) {
  return fmt::format(R"({{
  "field": {{"file": "field.vdb", "eigenvalues": "absolute", "scale": 4}}, "integrator": {},
  "light": {{"photons": {}, "wavelengths": {{"count": 6}}}}, "receiver": {{"resolution": [64, 48]}}}})",
                     integrator, photons);
}

inline const std::vector<std::string> plate_integrators{
    R"({"type": "photon_distribution"})",
    R"({"type": "photon_distribution", "density": {"kind": "gaussian", "tau": 2}})",
    R"({"type": "photon_distribution", "density": {"kind": "histogram"}})",
    R"({"type": "photon_distribution", "density": {"kind": "photon_differential"}})",
    R"({"type": "lens", "samples": 2, "mode": "scatter"})",
    R"({"type": "lens", "samples": 1, "mode": "gather", "image_plane": {"depth": [-0.25, -1]}})",
    R"({"type": "stretch"})"};

}  // namespace tensorray::test
