#pragma once
/// @file python/module/renders.h
/// Renders of scenes, as a whole and in shards.

#include <pybind11/pybind11.h>

namespace tensorray {

/// Adds `render` with its result, and the functions for shards, to the module.
void add_renders(pybind11::module_& module);

}  // namespace tensorray
