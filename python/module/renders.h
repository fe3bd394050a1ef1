#pragma once
/// @file python/module/renders.h
/// Renders of scenes.

#include <pybind11/pybind11.h>

namespace tensorray {

/// Adds `render` and its result to the module.
void add_renders(pybind11::module_& module);

}  // namespace tensorray
