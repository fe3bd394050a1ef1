#pragma once
/// @file tests/program/divided_scenes.h
/// Small scenes of the two methods whose work is divided, of the field in field.vdb.

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

}  // namespace tensorray::test
