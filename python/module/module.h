#pragma once
/// @file python/module/module.h
/// The parts of the module tensorray._tensorray, one a source file.

#include <pybind11/pybind11.h>

namespace tensorray {

void add_fields(pybind11::module_& module);         ///< Field and its functions.
void add_scene_request(pybind11::module_& module);  ///< SceneRequest.
void add_renders(pybind11::module_& module);        ///< `render` with its result, and the functions for shards.
void add_traces(pybind11::module_& module);         ///< `trace` and `landings`.

}  // namespace tensorray
