#pragma once
/// @file python/module/traces.h
/// Rays of Python, and the landings of a scene's light.

#include <pybind11/pybind11.h>

namespace tensorray {

/// Adds `trace` and `landings` to the module.
void add_traces(pybind11::module_& module);

}  // namespace tensorray
