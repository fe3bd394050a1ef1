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

/// Light by maps, of two directions, and by photons, on two plates.
inline const char* const lit_scene = R"({
  "field": {"file": "field.vdb", "eigenvalues": "absolute", "scale": 4},
  "objects": [{"plate": {"center": [0, 0, -2], "size": [6, 6]}}, {"plate": {"center": [0, 0, -3], "size": [9, 9]}}],
  "lights": [{"kind": "directional", "direction": [0.1, 0, -1], "angle": 0.5},
             {"kind": "point", "position": [0, 0.5, 3], "strength": 9, "caustic": "photons"}],
  "integrator": {"type": "scene", "max_samples": 8, "min_samples": 8, "bands": 4, "bands_per_sample": 4,
                 "caustic": {"resolution": 32, "rays": 1000, "passes": 2}, "photons": {"per_pass": 1500}},
  "camera": {"position": [3, -6, 2], "target": [0, 0, -1.5], "resolution": [40, 30]}})";

/// Paths above a plate with light. @param density  Of the light.
inline std::string plate_under_paths(const std::string& density) {
  return fmt::format(R"({{
  "field": {{"file": "field.vdb", "eigenvalues": "absolute", "scale": 4}}, "light": {{"photons": 20000}},
  "receiver": {{"resolution": [40, 32]}},
  "integrator": {{"type": "path_tracing", "max_samples": 8, "min_samples": 8, "context": {{"plate": true}},
                 "density": {{"kind": "{}"}}}},
  "camera": {{"resolution": [40, 30]}}}})",
                     density);
}

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
