#pragma once
/// Small scenes of all methods, of the field in field.vdb.

#include <string>
#include <vector>

#include <fmt/core.h>

namespace tensorray::test {

inline const char* const path_scene = R"({
  "field": {"file": "field.vdb", "eigenvalues": "absolute", "scale": 4},
  "integrator": {"type": "path_tracing", "max_samples": 64, "min_samples": 8, "noise": 0.01},
  "camera": {"resolution": [60, 50]}})";

/// Light by maps, of two directions, and by photons, on two plates.
inline const std::string lit_scene = R"({
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
  "field": {{"file": "field.vdb", "eigenvalues": "absolute", "scale": 4}}, "light": {{"photons": 8000}},
  "receiver": {{"resolution": [32, 24]}},
  "integrator": {{"type": "path_tracing", "max_samples": 8, "min_samples": 8, "context": {{"plate": true}},
                 "density": {{"kind": "{}"}}}},
  "camera": {{"resolution": [30, 22]}}}})",
                     density);
}

/// A scene of light on a plate, of a lens or of stretch. @param integrator  The value of its key.
inline std::string plate_scene(const std::string& integrator, int photons = 20000,
                               const std::string& resolution = "[32, 24]") {
  return fmt::format(R"({{
  "field": {{"file": "field.vdb", "eigenvalues": "absolute", "scale": 4}}, "integrator": {},
  "light": {{"photons": {}, "wavelengths": {{"count": 6}}}}, "receiver": {{"resolution": {}}}}})",
                     integrator, photons, resolution);
}

inline const std::string gaussian_photons =
    R"({"type": "photon_distribution", "density": {"kind": "gaussian", "tau": 2}})";
inline const std::string lens = R"({"type": "lens", "samples": 2, "mode": "gather"})";
inline const std::string stretch = R"({"type": "stretch", "stretch": {"resolution": 24, "pixels": 96}})";

inline const std::string polariscope = R"({"type": "polariscope", "arrangement": "plane", "samples": 12})";

}  // namespace tensorray::test
